#include "fem/files.hpp"

#include "fem/check.hpp"

#include <gtest/gtest.h>
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
