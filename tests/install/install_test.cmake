# Installs a build into an empty prefix, then builds the project consumer/ with what is there and runs its programs.
# The second program is the first C++ block of README.md. Arguments: see tests/CMakeLists.txt.

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# Writes the lines between the first ```cpp and the next ``` of a Markdown file. Not file(STRINGS): it would lose ; and [.
function(extract_first_cpp_block markdown output)
  file(READ ${markdown} text)
  string(FIND "${text}" "```cpp\n" begin)
  if(begin EQUAL -1)
    message(FATAL_ERROR "${markdown}: no ```cpp block; the README's example is tested, so it must have one")
  endif()
  string(SUBSTRING "${text}" ${begin} -1 text)
  string(FIND "${text}" "\n" begin)
  string(FIND "${text}" "\n```" end)
  math(EXPR length "${end} - ${begin}")
  string(SUBSTRING "${text}" ${begin} ${length} block)
  file(WRITE ${output} "${block}\n")
endfunction()

file(REMOVE_RECURSE ${work_dir})
extract_first_cpp_block(${readme} ${work_dir}/readme_example.cpp)
run(${CMAKE_COMMAND} --install ${build_dir} --prefix ${work_dir}/prefix)
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/consumer -B ${work_dir}/build -G ${generator}
  -D CMAKE_PREFIX_PATH=${work_dir}/prefix
  -D CMAKE_BUILD_TYPE=${build_type}
  -D CMAKE_CXX_COMPILER=${compiler}
  -D CMAKE_CXX_FLAGS=${flags}
  -D readme_example=${work_dir}/readme_example.cpp)
run(${CMAKE_COMMAND} --build ${work_dir}/build)
run(${work_dir}/build/consumer)
run(${work_dir}/build/readme_example)
