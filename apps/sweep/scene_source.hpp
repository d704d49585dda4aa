#pragma once

#include "apps/base/toml_reader.hpp"
#include "apps/scene/scene.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// A value that a key of a scene takes in a run: a number, or a word. One in brackets or quotes is read as in a file.
struct KeyVariant {
  double number = 0;
  std::string word;  // empty: the number counts
  bool operator==(const KeyVariant&) const = default;
};

/// Text as a key takes it: a number where it is one. @throws InputError for text that is empty.
KeyVariant key_variant(std::string_view text);

/// 17 significant digits, or the word.
std::string text_of(const KeyVariant&);

/// The file of a scene as a tree of values whose keys can be changed before it is read. Body files that it names are
/// part of the tree.
class SceneSource {
 public:
  /// A path, or the name of a built-in scene. @throws InputError.
  explicit SceneSource(const std::string& path_or_name);

  /// Sets what a path leads to: keys separated by dots. An entry of an array of tables is named by its name or [index];
  /// [*] stands for all. Keys and tables that the scene lacks are added. @throws InputError for an entry that is not
  /// there, with the nearest names.
  void set(const std::string& path, const KeyVariant&);

  /// Multiplies the numbers there. @throws InputError where the scene has none.
  void multiply(const std::string& path, double factor);

  /// Has the scene this key? Then what it may be is for the reader of scenes to say.
  bool has(const std::string& path) const;

  /// The values that a path stands for, each by a path without names of entries and without [*].
  std::vector<std::string> places(const std::string& path) const;

  /// The scene with all changes. @throws InputError with the faults found.
  Scene read() const;

  /// SHA-256 of all that the scene is made of.
  const std::string& digest() const { return digest_; }
  /// Folder of bodies kept by `run`.
  const std::filesystem::path& bodies_kept_in() const { return bodies_kept_in_; }

 private:
  toml_reader::Value root_;
  std::filesystem::path folder_, bodies_kept_in_;
  std::string digest_;
};

}  // namespace flexboom
