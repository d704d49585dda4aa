#pragma once

#include <filesystem>

namespace flexboom {

/// One process at a time in a folder. The lock is the kernel's (flock): it ends with the process, however that ends.
class FolderLock {
 public:
  /// @throws InputError naming the folder, and the process that is in it or why nothing can be written there.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace flexboom
