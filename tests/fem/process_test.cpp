#include "fem/base/process.hpp"

#include "mesh_file_testing.hpp"

#include <cstdlib>

namespace flexboom::testing {
namespace {

ProcessResult shell(const std::string& script, const ProcessOptions& options = {}) {
  return run_process({program_on_path("sh"), "-c", script}, options);
}

TEST(Process, GivesOutputAndExitCode) {
  const ProcessResult result = shell("echo one; echo two >&2; exit 3");
  EXPECT_EQ(result.output, "one\n");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_GT(result.memory_mb, 0);
  EXPECT_EQ(shell("echo one; echo two >&2", {.keeps_errors = true}).output, "one\ntwo\n");
  EXPECT_EQ(shell("cat; echo end").output, "end\n") << "nothing to read";
  EXPECT_EQ(shell("kill -9 $$").exit_code, -1);
  EXPECT_EQ(run_process({"/nowhere/program"}, {}).exit_code, -1);
}

TEST(Process, RunsInItsFolderWithItsThreads) {
  const Folder folder;
  EXPECT_EQ(shell("pwd -P", {.folder = folder.path}).output, std::filesystem::canonical(folder.path).string() + "\n");
  ::setenv("OMP_NUM_THREADS", "7", 1);
  EXPECT_EQ(shell("echo $OMP_NUM_THREADS").output, "7\n");
  EXPECT_EQ(shell("echo $OMP_NUM_THREADS", {.one_thread = true}).output, "1\n");
  ::unsetenv("OMP_NUM_THREADS");
  EXPECT_EQ(program_on_path("no such program"), "");
}

}  // namespace
}  // namespace flexboom::testing
