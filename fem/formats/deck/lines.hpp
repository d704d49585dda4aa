#pragma once

#include "fem/base/label_index.hpp"
#include "fem/base/text_reader.hpp"

#include <Eigen/Core>

#include <deque>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

// What the readers of decks (CalculiX/Abaqus, Nastran) share.
namespace flexboom {

/// The lines of a deck and of the files that it includes, in the order in which they count. Views into them stay good
/// as long as the deck.
class DeckText {
 public:
  /// @param file path of the text; the text must outlive the deck.
  DeckText(std::string_view text, const std::string& file);

  /// The next line, which stays the next one until skip_line(). Nothing at the end of the deck.
  std::optional<std::string_view> peek_line();
  void skip_line() { peeked_.reset(); }

  /// The lines of a file come next. @param name relative to the file that `at` is in.
  /// @throws InputError at `at`: it cannot be read, includes itself, or too many are nested or included.
  void include(std::string_view name, std::string_view at);

  /// "file:line:column" of a view into the deck.
  std::string location(std::string_view at) const { return source_of(at).location(at); }
  /// "file:line".
  std::string line_location(std::string_view at) const;

  [[noreturn]] void fail(std::string_view at, const std::string& message) const { source_of(at).fail(at, message); }

  /// A field as a number. @throws InputError naming `what` should be there.
  long integer(std::string_view field, std::string_view what) const;
  /// In [low, high].
  long integer(std::string_view field, std::string_view what, long low, long high) const;

 private:
  const TextReader& source_of(std::string_view at) const;

  std::deque<std::string> texts_;             // of included files
  std::deque<TextReader> sources_;            // the deck, then what it includes
  std::vector<TextReader*> active_;           // the file being read last
  std::vector<std::filesystem::path> paths_;  // of active_
  std::optional<std::string_view> peeked_;
  size_t included_bytes_ = 0;
};

/// What was read as something else or left out, each said once.
class Notes {
 public:
  void add(const std::string& note) {
    if (known_.insert(note).second) list_.push_back(note);
  }
  const std::vector<std::string>& list() const { return list_; }

 private:
  std::vector<std::string> list_;
  std::set<std::string> known_;
};

/// Nodes by their label.
class DeckNodes {
 public:
  void add(long label, const Eigen::Vector3d& position, std::string_view at);

  /// Sorts out what was said twice. To be called before anything is found.
  /// @throws InputError where a label is given twice with different positions.
  void finish(const DeckText&);

  int find(long label) const { return index_.find(label); }
  int count() const { return static_cast<int>(labels_.size()); }
  const std::vector<long>& labels() const { return labels_; }
  const Eigen::Vector3d& position(int node) const { return positions_[static_cast<size_t>(node)]; }
  Eigen::Matrix3Xd positions() const;

 private:
  std::vector<long> labels_;
  std::vector<Eigen::Vector3d> positions_;
  std::vector<std::string_view> at_;
  LabelIndex index_{{}};
};

/// Upper case, without blanks and tabs.
std::string upper_key(std::string_view);

/// Fields between commas, each trimmed. A comma at the end of the line begins no field.
void split_at_commas(std::string_view line, std::vector<std::string_view>& fields);

/// Text in quotes without them.
std::string_view unquoted(std::string_view);

/// The node that occurs a second time in a list of few, -1 if there is none.
template <class Label>
Label repeated(const Label* labels, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = i + 1; k < count; ++k) {
      if (labels[i] == labels[k]) return labels[i];
    }
  }
  return -1;
}

}  // namespace flexboom
