#include "fem/base/files.hpp"

#include "fem/base/check.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <ostream>
#include <sstream>

namespace flexboom {
namespace {

namespace fs = std::filesystem;

/// A folder of its own that goes with the test.
struct Folder {
  fs::path path = fs::temp_directory_path() / ("flexboom_files_" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
};

std::string text_of(const fs::path& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string message_of(const fs::path& path, size_t most = largest_file) {
  try {
    file_bytes(path, most);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(FileBytes, ReadsFilesAlone) {
  const Folder folder;
  const fs::path pipe = folder.path / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);  // without a writer: to open it would wait for one
  for (const fs::path& path : {pipe, fs::path("/dev/zero"), fs::path("/dev/null")})
    EXPECT_EQ(message_of(path), "cannot read " + path.string() + ": it is a device, pipe or socket, not a file");
  EXPECT_EQ(message_of(folder.path), "cannot read " + folder.path.string() + ": Is a directory");
  EXPECT_GT(file_bytes("/proc/self/status").size(), 0U);  // a file that says that it is empty
}

TEST(FileBytes, HasALimit) {
  const Folder folder;
  write_file(folder.path / "a.txt", std::string(3 << 20, 'x'));
  EXPECT_EQ(file_bytes(folder.path / "a.txt").size(), size_t{3} << 20);
  EXPECT_NE(message_of(folder.path / "a.txt", 2 << 20).find("larger than 2 MB"), std::string::npos);
  fs::resize_file(folder.path / "a.txt", largest_file + 1);  // sparse: nothing is read
  EXPECT_NE(message_of(folder.path / "a.txt").find("larger than 4096 MB"), std::string::npos);
}

TEST(WriteFile, ReplacesTheWholeText) {
  const Folder folder;
  write_file(folder.path / "a.txt", "a long first text");
  write_file(folder.path / "a.txt", "second");
  EXPECT_EQ(text_of(folder.path / "a.txt"), "second");
}

TEST(WriteFile, LeavesTheOldTextWhenTheNewOneFails) {
  const Folder folder;
  write_file(folder.path / "a.txt", "old");
  EXPECT_THROW(write_file(folder.path / "a.txt",
                          [](std::ostream& out) {
                            out << "half of it";
                            out.setstate(std::ios::badbit);
                          }),
               InputError);
  EXPECT_EQ(text_of(folder.path / "a.txt"), "old");
  EXPECT_FALSE(fs::exists(folder.path / "a.txt.part"));
}

TEST(WriteFile, NeverReplacesADevice) {
  EXPECT_THROW(write_file("/dev/full", "x"), InputError);
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  EXPECT_NO_THROW(write_file("/dev/null", "x"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(WriteFile, NamesTheFileAndTheReason) {
  try {
    write_file("/nowhere/a.txt", "x");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "cannot write /nowhere/a.txt: No such file or directory");
  }
}

}  // namespace
}  // namespace flexboom
