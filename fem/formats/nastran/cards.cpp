#include "fem/formats/nastran/cards.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace flexboom::nastran {
namespace {

constexpr std::string_view include_word = "INCLUDE";
constexpr size_t per_line = 8;  // data fields
constexpr size_t small_width = 8, large_width = 16;
constexpr size_t large_per_line = 4;
constexpr long largest_id = 999'999'999;
constexpr size_t most_fields = 10'000'000;  // of one card

struct Fields {
  std::array<std::string_view, per_line + 2> all;  // name, data, continuation mark
  bool large = false;
};

bool is_large(std::string_view name) { return name.find('*') != std::string_view::npos; }

/// Fields of fixed width. Tabs go to the next multiple of eight columns.
Fields fixed_fields(std::string_view line) {
  Fields fields;
  fields.large = is_large(line.substr(0, small_width));
  const size_t data = fields.large ? large_per_line : per_line;
  const size_t width = fields.large ? large_width : small_width;
  std::array<size_t, per_line + 2> begin{}, end{};
  size_t column = 0;
  for (size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\t') {
      column = (column / small_width + 1) * small_width;
      continue;
    }
    const size_t place = column < small_width ? 0 : 1 + (column - small_width) / width;
    ++column;
    if (place > data + 1) break;
    if (line[i] == ' ') continue;
    if (end[place] == 0) begin[place] = i;
    end[place] = i + 1;
  }
  for (size_t k = 0; k <= data; ++k) fields.all[k] = line.substr(begin[k], end[k] - begin[k]);
  fields.all[per_line + 1] = line.substr(begin[data + 1], end[data + 1] - begin[data + 1]);
  return fields;
}

}  // namespace

std::optional<double> nastran_real(std::string_view field) {
  if (const auto value = to_real(field, true)) return value;
  const size_t sign = field.find_last_of("+-");
  if (sign == std::string_view::npos || sign == 0 || field.size() > 2 * large_width) return {};
  const char before = field[sign - 1];
  if (before != '.' && (before < '0' || before > '9')) return {};
  std::string text(field);
  text.insert(sign, 1, 'e');
  return to_real(text);
}

Cards::Cards(std::string_view text, const std::string& file) : text_(text, file) { read_case_control(text); }

// Without "BEGIN BULK" all is bulk data.
void Cards::read_case_control(std::string_view text) {
  bool has_begin = false, has_control = false;
  TextReader lines(text, "");
  while (const auto line = lines.next_line()) {
    const std::string key = upper_key(line->substr(0, 2 * small_width));
    has_begin = has_begin || key.starts_with("BEGINBULK") || key == "BEGIN";
    has_control = has_control || key == "CEND" || key.starts_with("SOL1");
    if (has_begin) break;
  }
  if (!has_begin && has_control) fail({}, "BEGIN BULK is missing after the case control");
  while (has_begin) {
    const auto line = text_.peek_line();
    if (!line) fail({}, "BEGIN BULK is missing after the case control");
    text_.skip_line();
    const std::string_view stripped = trimmed(line->substr(0, line->find('$')));
    const std::string key = upper_key(stripped);
    if (key.starts_with("BEGIN")) {
      has_begin_ = true;
      return;
    }
    if (key.starts_with(include_word)) {
      include(stripped);
      continue;
    }
    case_.given = case_.given || key == "CEND";
    case_line(stripped);
  }
}

void Cards::case_line(std::string_view line) {
  const std::string key = upper_key(line);
  const auto value = [&](std::string_view name) -> std::optional<long> {
    if (!key.starts_with(name)) return {};
    const size_t equals = key.find('=');
    if (equals == std::string::npos || (key[name.size()] != '=' && key[name.size()] != '(')) return {};
    return to_integer(std::string_view(key).substr(equals + 1));
  };
  if (const auto spc = value("SPC")) {
    case_.other_spc = case_.other_spc || (case_.spc && *case_.spc != *spc);
    if (!case_.spc) {
      case_.spc = spc;
      case_.spc_at = line;
    }
  }
  if (const auto mpc = value("MPC"); mpc && !case_.mpc) {
    case_.mpc = mpc;
    case_.mpc_at = line;
  }
  if (const auto method = value("METHOD"); method && !case_.method) {
    case_.method = method;
    case_.method_at = line;
  }
  if (key.starts_with("SOL") && key != "SOL103" && key != "SOLSEMODES" && key != "SOL3")
    case_notes_.push_back(fmt::format("{}: only the modes are computed", line));
  for (const std::string_view name : {"WTMASS", "CK1", "CM1"})
    if (key.starts_with(fmt::format("PARAM,{}", name)))
      fail(line, fmt::format("PARAM,{} is read behind BEGIN BULK alone; put it there", name));
  for (const std::string_view refused : {"STATSUB", "K2GG", "M2GG", "K2PP", "M2PP", "A2GG"}) {
    if (key.starts_with(refused) && key.find('=') != std::string::npos)
      fail(line, fmt::format("{} changes the modes and is not understood", quoted(line)));
  }
}

// A name in quotes may go on over several lines.
void Cards::include(std::string_view line) {
  std::string name(trimmed(line.substr(include_word.size())));
  while (name.starts_with('\'') && (name.size() < 2 || !name.ends_with('\''))) {
    const auto more = text_.peek_line();
    if (!more) fail(line, "INCLUDE: the closing quote is missing");
    text_.skip_line();
    name += trimmed(*more);
  }
  text_.include(unquoted(name), line);
}

bool Cards::next_line(std::string_view& line) {
  while (const auto raw = text_.peek_line()) {
    const std::string_view stripped = raw->substr(0, raw->find('$'));
    if (trimmed(stripped).empty()) {
      if (trimmed(*raw).starts_with("$HMNAME PROP")) remember_name(trimmed(*raw));
      if (stripped.size() == raw->size() && stripped.size() >= small_width) blank_ = stripped;
      text_.skip_line();
      continue;
    }
    const std::string_view word = trimmed(stripped);
    const char initial = word[0];
    const bool may_be_mark = initial == 'I' || initial == 'i' || initial == 'E' || initial == 'e';
    if (may_be_mark && upper_key(word.substr(0, include_word.size())) == include_word) {
      text_.skip_line();
      include(word);
      continue;
    }
    if (may_be_mark && upper_key(word) == "ENDDATA") {
      has_end_ = true;
      return false;
    }
    line = stripped;
    return true;
  }
  return false;
}

/// Joins a line to the card.
void Cards::append(std::string_view line, bool first) {
  Fields fields;
  size_t count = per_line;
  if (line.find(',') != std::string_view::npos) {
    std::vector<std::string_view> free;
    for (std::string_view rest = line;;) {
      const size_t comma = std::min(rest.find(','), rest.size());
      free.push_back(trimmed(rest.substr(0, comma)));
      if (comma == rest.size()) break;
      rest.remove_prefix(comma + 1);
    }
    fields.large = is_large(free[0]);
    count = fields.large ? large_per_line : per_line;
    while (free.size() > 1 && free.back().empty()) free.pop_back();
    const bool marked = free.size() > 1 && (free.back() == "+" || free.back() == "*" ||
                                            (free.back()[0] == '+' && !nastran_real(free.back())));
    if (marked) {
      fields.all[per_line + 1] = free.back();
      free.pop_back();
    }
    if (free.size() == count + 2) {
      fields.all[per_line + 1] = free.back();
      free.pop_back();
    }
    if (free.size() > count + 1)
      fail(free[count + 1],
           fmt::format("a line has {} fields of data; {} is one too many", count, quoted(free[count + 1])));
    std::ranges::copy(free, fields.all.begin());
  } else {
    fields = fixed_fields(line);
    count = fields.large ? large_per_line : per_line;
  }
  const std::string_view name = fields.all[0];
  if (first) {
    card_.fields.clear();
    card_.at = name;
    card_.name = upper_key(name.substr(0, name.find('*')));
  } else {
    if (name.size() > 1 && (mark_.size() <= 1 || name.substr(1) != mark_.substr(1)))
      fail(line, fmt::format("continuation {} must follow the line that ends with it; the line above ends with {}",
                             quoted(name), mark_.empty() ? "none" : quoted(mark_)));
    const size_t half = card_.fields.size() % per_line;
    if (half != 0 && !(fields.large && half == large_per_line))
      card_.fields.resize(card_.fields.size() + per_line - half, std::string_view(line.data(), 0));
  }
  mark_ = fields.all[per_line + 1];
  card_.fields.insert(card_.fields.end(), fields.all.begin() + 1, fields.all.begin() + 1 + static_cast<long>(count));
  if (card_.fields.size() > most_fields) fail(line, "a card has more than ten million fields");
}

const Card* Cards::next() {
  const auto continues = [](std::string_view line) {
    return line[0] == '+' || line[0] == '*' || line[0] == ' ' || line[0] == '\t' || line[0] == ',';
  };
  std::string_view line;
  if (!next_line(line)) return nullptr;
  text_.skip_line();
  // A name may be indented by less than its field; a line whose first field is blank goes on.
  const auto is_continuation = [&continues](std::string_view l) {
    if (!continues(l)) return false;
    if (l[0] != ' ' && l[0] != '\t') return true;
    const size_t comma = l.find(',');
    const std::string_view name = comma != std::string_view::npos ? l.substr(0, comma) : fixed_fields(l).all[0];
    return trimmed(name).empty() || trimmed(name)[0] == '+' || trimmed(name)[0] == '*';
  };
  if (is_continuation(line)) fail(line, "a continuation without a card above");
  append(line, true);
  blank_ = {};
  while (next_line(line) && is_continuation(line)) {
    if (!blank_.empty())
      fail(blank_,
           "a line of blanks within a card: some programs skip it, others take its fields; begin it with + or "
           "leave it out");
    text_.skip_line();
    append(line, false);
  }
  while (!card_.fields.empty() && card_.fields.back().empty()) card_.fields.pop_back();
  return &card_;
}

void Cards::remember_name(std::string_view comment) {
  const std::string_view rest = trimmed(comment.substr(std::string_view("$HMNAME PROP").size()));
  const size_t open = rest.find('"'), close = rest.find('"', open + 1);
  if (open == std::string_view::npos || close == std::string_view::npos) return;
  const auto id = to_integer(trimmed(rest.substr(0, open)));
  if (id) property_names_.emplace_back(*id, rest.substr(open + 1, close - open - 1));
}

double Cards::real(const Card& card, size_t i, std::string_view what) const {
  const std::string_view field = card.field(i);
  if (field.empty()) fail(card.at, fmt::format("{}: {} is missing", card.name, what));
  if (const auto value = nastran_real(field)) return *value;
  fail(field, fmt::format("{}: {} is not a finite number: {}", card.name, what, quoted(field)));
}

double Cards::real_or(const Card& card, size_t i, double otherwise, std::string_view what) const {
  return card.blank(i) ? otherwise : real(card, i, what);
}

long Cards::id(const Card& card, size_t i, std::string_view what) const {
  const std::string_view field = card.field(i);
  if (field.empty()) fail(card.at, fmt::format("{}: {} is missing", card.name, what));
  const auto value = to_integer(field);
  if (!value) fail(field, fmt::format("{}: {} is not a whole number: {}", card.name, what, quoted(field)));
  if (*value < 1 || *value > largest_id)
    fail(field, fmt::format("{}: {} is {}; it must be 1 to {}", card.name, what, *value, largest_id));
  return *value;
}

long Cards::id_or(const Card& card, size_t i, long otherwise, std::string_view what) const {
  const std::string_view field = card.field(i);
  if (field.empty()) return otherwise;
  const auto value = to_integer(field);
  if (value && *value == otherwise) return otherwise;
  return id(card, i, what);
}

std::vector<int> Cards::components(const Card& card, size_t i) const {
  const std::string_view field = card.field(i);
  std::vector<int> result;
  for (const char c : field) {
    if (c < '1' || c > '6')
      fail(field, fmt::format("{}: components are digits 1 to 6, not {}", card.name, quoted(field)));
    result.push_back(c - '1');
  }
  if (result.empty()) fail(card.at, fmt::format("{}: the components are missing", card.name));
  return result;
}

}  // namespace flexboom::nastran
