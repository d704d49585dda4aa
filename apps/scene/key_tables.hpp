#pragma once

#include <string>
#include <vector>

/// The keys of scene and body files as documentation.
namespace flexboom {

struct KeyRow {
  std::string key, unit, what;
  std::string otherwise;  // Markdown; empty: the key is required, or its table has the defaults
};

/// A table of a file, or keys that several tables have.
struct KeySection {
  std::string title;  // "[accuracy]", "[[bodies.segments]]", "place"
  std::string what;
  std::vector<KeyRow> rows;
};

/// All of them, in the order of a file.
std::vector<KeySection> key_sections();

/// A heading, what it is, a table.
std::string to_markdown(const KeySection&);

}  // namespace flexboom
