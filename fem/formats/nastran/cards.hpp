#pragma once

#include "fem/formats/deck/lines.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom::nastran {

/// A card of the bulk data: "GRID" and what follows, continuations joined. Every line of a card has eight fields; two
/// lines of large fields have eight together. So field i of a card is where the manuals have it, without the name and
/// the continuation marks.
struct Card {
  std::string name;  // upper case, without *
  std::string_view at;
  std::vector<std::string_view> fields;

  std::string_view field(size_t i) const { return i < fields.size() ? fields[i] : std::string_view(at.data(), 0); }
  bool blank(size_t i) const { return field(i).empty(); }
};

/// What the executive and case control say that matters to modes.
struct CaseControl {
  bool given = false;                    // is there any?
  std::optional<long> spc, mpc, method;  // of the first subcase that has one
  bool other_spc = false;                // a later subcase has another
  std::string_view spc_at, mpc_at, method_at;
};

/// A real number as Nastran writes it: 1.5-3 is 1.5e-3. Nothing if it is something else.
std::optional<double> nastran_real(std::string_view);

/// Cuts a deck into cards.
class Cards {
 public:
  /// Reads the executive and case control, if there are any. @throws InputError on what changes the modes.
  Cards(std::string_view text, const std::string& file);

  DeckText& text() { return text_; }
  const DeckText& text() const { return text_; }
  const CaseControl& case_control() const { return case_; }
  const std::vector<std::string>& case_notes() const { return case_notes_; }

  /// Has a deck with BEGIN BULK come to its end without ENDDATA?
  bool is_cut_off() const { return has_begin_ && !has_end_; }

  /// The next card, or null at the end of the bulk data. Good until the next call.
  const Card* next();

  /// Comments of HyperMesh that name things: "$HMNAME PROP 1"wing" ..." seen so far, (id, name).
  const std::vector<std::pair<long, std::string>>& property_names() const { return property_names_; }

  [[noreturn]] void fail(std::string_view at, const std::string& message) const { text_.fail(at, message); }

  // Fields of a card as numbers. @throws InputError naming `what` should be there.
  double real(const Card&, size_t i, std::string_view what) const;
  double real_or(const Card&, size_t i, double otherwise, std::string_view what) const;
  long id(const Card&, size_t i, std::string_view what) const;
  long id_or(const Card&, size_t i, long otherwise, std::string_view what) const;

  /// Digits 1 to 6. @throws InputError on other letters.
  std::vector<int> components(const Card&, size_t i) const;

 private:
  void read_case_control(std::string_view text);
  void case_line(std::string_view line);
  void include(std::string_view line);
  bool next_line(std::string_view& line);
  void append(std::string_view line, bool first);
  void remember_name(std::string_view comment);

  DeckText text_;
  CaseControl case_;
  bool has_begin_ = false, has_end_ = false;  // of the bulk data
  std::vector<std::string> case_notes_;
  Card card_;
  std::string_view mark_;   // at the end of the last line of the card
  std::string_view blank_;  // the last line of blanks since then
  std::vector<std::pair<long, std::string>> property_names_;
};

}  // namespace flexboom::nastran
