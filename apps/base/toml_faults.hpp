#pragma once

#include "apps/base/toml_value.hpp"

#include <map>
#include <set>
#include <string>
#include <vector>

namespace flexboom::toml_reader {

/// Collects faults under key paths such as "bodies[1].segments[0].length". Only the first fault of a key is kept, and
/// none below a key that is faulty itself: what follows from a fault is noise.
class Faults {
 public:
  /// Remembers where a key path stands; the last call wins.
  void locate(const std::string& path, const Place&);

  /// A fault at the place of its path, or of the nearest path above that has a place.
  void add(const std::string& path, const std::string& text);
  void add(const std::string& path, const Place&, const std::string& text);

  /// Goes on with the text of the fault at this path, if there is one.
  void append(const std::string& path, const std::string& text);

  /// Whether nothing was found at this path, above it or below it.
  bool clean(const std::string& path) const;
  bool empty() const { return faults_.empty(); }

  /// @throws InputError with one line per fault, in the order of the file.
  void throw_if_any() const;

  /// From now on, every key that a reader knows is noted there by its path, "bodies[].name".
  void note_keys(std::set<std::string>& keys) { keys_ = &keys; }
  void note_key(const std::string& path);

 private:
  struct Fault {
    Place place;
    std::string path, text;
  };
  Place place_of(std::string path) const;

  std::map<std::string, Place> places_;
  std::vector<Fault> faults_;
  std::set<std::string>* keys_ = nullptr;
};

}  // namespace flexboom::toml_reader
