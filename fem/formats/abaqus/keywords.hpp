#pragma once

#include "fem/formats/deck/lines.hpp"

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom::abaqus {

/// A keyword line: "*SOLID SECTION, ELSET=Eall" has the name "SOLIDSECTION".
struct Keyword {
  struct Parameter {
    std::string key;         // upper case, without blanks
    std::string_view value;  // as written, without quotes; empty if there is none
    std::string_view at;
  };
  std::string name;
  std::string_view at;
  std::vector<Parameter> parameters;

  /// Value of a parameter, nothing if it is not there.
  std::optional<std::string_view> find(std::string_view key) const;
  bool has(std::string_view key) const { return find(key).has_value(); }
};

/// Keywords and data lines of a deck; comments, blank lines and *INCLUDE are gone.
class Lines {
 public:
  Lines(std::string_view text, const std::string& file) : text_(text, file) {}

  DeckText& text() { return text_; }
  const DeckText& text() const { return text_; }

  /// The next keyword; data lines before it are skipped. Nothing at the end of the deck.
  std::optional<Keyword> next_keyword();

  /// Fields of the next data line, or null when a keyword or the end comes next. Good until the next call.
  const std::vector<std::string_view>* next_data();

  /// Where comments are collected, if anywhere.
  std::vector<std::string_view>* comments = nullptr;

  /// The last data line, and whether it ended with a comma.
  std::string_view line() const { return line_; }
  bool continues() const { return line_.ends_with(','); }

  /// @throws InputError at the first parameter of a keyword that is not among these.
  void allow(const Keyword&, std::initializer_list<std::string_view> parameters) const;

  /// Value of a parameter. @throws InputError if it is missing.
  std::string_view need(const Keyword&, std::string_view key) const;

 private:
  std::optional<std::string_view> peek();
  Keyword parse(std::string_view line) const;
  void continue_keyword(Keyword&, std::string_view line);

  DeckText text_;
  std::string_view line_;
  std::vector<std::string_view> fields_;
};

}  // namespace flexboom::abaqus
