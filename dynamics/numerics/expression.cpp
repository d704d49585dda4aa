#include "dynamics/numerics/expression.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <muParserBase.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string_view>
#include <utility>

// muParser reads the text, and this file is its only wrapper. It computes in double and differentiates by differences,
// which loses half of the digits. So its operators here do not compute but write down what they are asked for. The list
// is evaluated with derivatives.

namespace flexboom {
namespace {

constexpr int max_nodes = 256;

/// Value and first two derivatives by t.
struct Jet {
  double v = 0, d = 0, dd = 0;
};

/// f(x) from f, f', f'' at x.
Jet chain(const Jet& x, double f, double f1, double f2) { return {f, f1 * x.d, f2 * x.d * x.d + f1 * x.dd}; }

Jet sum(const Jet& a, const Jet& b, double sign) { return {a.v + sign * b.v, a.d + sign * b.d, a.dd + sign * b.dd}; }
Jet product(const Jet& a, const Jet& b) {
  return {a.v * b.v, a.d * b.v + a.v * b.d, a.dd * b.v + 2 * a.d * b.d + a.v * b.dd};
}
Jet reciprocal(const Jet& x) { return chain(x, 1 / x.v, -1 / (x.v * x.v), 2 / (x.v * x.v * x.v)); }
Jet logarithm(const Jet& x) { return chain(x, std::log(x.v), 1 / x.v, -1 / (x.v * x.v)); }
Jet exponential(const Jet& x) { return chain(x, std::exp(x.v), std::exp(x.v), std::exp(x.v)); }
Jet flag(bool b) { return {b ? 1.0 : 0.0, 0, 0}; }

Jet power(const Jet& x, const Jet& y) {
  if (y.d != 0 || y.dd != 0) {
    Jet r = exponential(product(y, logarithm(x)));
    r.v = std::pow(x.v, y.v);
    return r;
  }
  const double p = y.v;  // a factor that is zero ends the row of derivatives also where x = 0
  return chain(x, std::pow(x.v, p), p == 0 ? 0 : p * std::pow(x.v, p - 1),
               p == 0 || p == 1 ? 0 : p * (p - 1) * std::pow(x.v, p - 2));
}

Jet arc_tangent(const Jet& y, const Jet& x) {
  const double r2 = x.v * x.v + y.v * y.v, turn = (x.v * y.d - y.v * x.d) / r2;
  return {std::atan2(y.v, x.v), turn, (x.v * y.dd - y.v * x.dd) / r2 - 2 * turn * (x.v * x.d + y.v * y.d) / r2};
}

struct Operation {
  std::string_view name;
  int arguments;
  int precedence;  // of a binary operator; -1: a function; -2: a sign before its argument
  Jet (*at)(const Jet* x);
};

// clang-format off
constexpr Operation operations[] = {
    {"+", 2, mu::prADD_SUB, [](const Jet* x) { return sum(x[0], x[1], 1); }},
    {"-", 2, mu::prADD_SUB, [](const Jet* x) { return sum(x[0], x[1], -1); }},
    {"*", 2, mu::prMUL_DIV, [](const Jet* x) { return product(x[0], x[1]); }},
    {"/", 2, mu::prMUL_DIV, [](const Jet* x) { return product(x[0], reciprocal(x[1])); }},
    {"^", 2, mu::prPOW, [](const Jet* x) { return power(x[0], x[1]); }},
    {"<", 2, mu::prCMP, [](const Jet* x) { return flag(x[0].v < x[1].v); }},
    {">", 2, mu::prCMP, [](const Jet* x) { return flag(x[0].v > x[1].v); }},
    {"<=", 2, mu::prCMP, [](const Jet* x) { return flag(x[0].v <= x[1].v); }},
    {">=", 2, mu::prCMP, [](const Jet* x) { return flag(x[0].v >= x[1].v); }},
    {"==", 2, mu::prCMP, [](const Jet* x) { return flag(x[0].v == x[1].v); }},
    {"!=", 2, mu::prCMP, [](const Jet* x) { return flag(x[0].v != x[1].v); }},
    {"&&", 2, mu::prLAND, [](const Jet* x) { return flag(x[0].v != 0 && x[1].v != 0); }},
    {"||", 2, mu::prLOR, [](const Jet* x) { return flag(x[0].v != 0 || x[1].v != 0); }},
    {"-", 1, -2, [](const Jet* x) { return Jet{-x->v, -x->d, -x->dd}; }},
    {"+", 1, -2, [](const Jet* x) { return *x; }},
    {"sin", 1, -1, [](const Jet* x) { const double s = std::sin(x->v); return chain(*x, s, std::cos(x->v), -s); }},
    {"cos", 1, -1, [](const Jet* x) { const double c = std::cos(x->v); return chain(*x, c, -std::sin(x->v), -c); }},
    {"tan", 1, -1, [](const Jet* x) { const double f = std::tan(x->v), g = 1 + f * f; return chain(*x, f, g, 2 * f * g); }},
    {"asin", 1, -1, [](const Jet* x) { const double c = std::sqrt((1 - x->v) * (1 + x->v)); return chain(*x, std::asin(x->v), 1 / c, x->v / (c * c * c)); }},
    {"acos", 1, -1, [](const Jet* x) { const double c = std::sqrt((1 - x->v) * (1 + x->v)); return chain(*x, std::acos(x->v), -1 / c, -x->v / (c * c * c)); }},
    {"atan", 1, -1, [](const Jet* x) { const double g = 1 / (1 + x->v * x->v); return chain(*x, std::atan(x->v), g, -2 * x->v * g * g); }},
    {"atan2", 2, -1, [](const Jet* x) { return arc_tangent(x[0], x[1]); }},
    {"sinh", 1, -1, [](const Jet* x) { const double s = std::sinh(x->v); return chain(*x, s, std::cosh(x->v), s); }},
    {"cosh", 1, -1, [](const Jet* x) { const double c = std::cosh(x->v); return chain(*x, c, std::sinh(x->v), c); }},
    {"tanh", 1, -1, [](const Jet* x) { const double f = std::tanh(x->v), g = 1 / (std::cosh(x->v) * std::cosh(x->v)); return chain(*x, f, g, -2 * f * g); }},
    {"exp", 1, -1, [](const Jet* x) { return exponential(*x); }},
    {"log", 1, -1, [](const Jet* x) { return logarithm(*x); }},
    {"sqrt", 1, -1, [](const Jet* x) { const double f = std::sqrt(x->v); return chain(*x, f, 0.5 / f, -0.25 / (f * x->v)); }},
    {"abs", 1, -1, [](const Jet* x) { return chain(*x, std::abs(x->v), x->v > 0 ? 1 : x->v < 0 ? -1 : 0, 0); }},
    {"sign", 1, -1, [](const Jet* x) { return Jet{x->v > 0 ? 1.0 : x->v < 0 ? -1.0 : 0.0, 0, 0}; }},
    {"step", 1, -1, [](const Jet* x) { return flag(x->v >= 0); }},
    {"min", 2, -1, [](const Jet* x) { return x[1].v < x[0].v ? x[1] : x[0]; }},
    {"max", 2, -1, [](const Jet* x) { return x[1].v > x[0].v ? x[1] : x[0]; }},
    {"if", 3, -1, [](const Jet* x) { return x[0].v != 0 ? x[1] : x[2]; }},
};
// clang-format on

constexpr std::pair<const char*, double> constants[] = {{"pi", std::numbers::pi}, {"e", std::numbers::e}};

/// What the operators of the one parser that runs in this thread write to.
thread_local std::vector<Expression::Node>* record = nullptr;

/// The number that stands for a node in muParser's arithmetic.
double keep(Expression::Node node) {
  if (record->size() >= max_nodes) throw mu::ParserError("more than 256 operations");
  record->push_back(node);
  return static_cast<double>(record->size() - 1);
}

constexpr bool puts_in_order(const Operation& o) {
  return o.precedence == mu::prCMP && o.name != "==" && o.name != "!=";
}

template <size_t row, class... Arguments>
double keep_operation(Arguments... arguments) {
  if constexpr (puts_in_order(operations[row]))
    for (const double argument : {arguments...}) {
      const int of = (*record)[static_cast<size_t>(argument)].operation;
      if (of >= 0 && puts_in_order(operations[of]))
        throw mu::ParserError("a comparison is 0 or 1 and is compared again; write (a < t) * (t < b)");
    }
  return keep({static_cast<int>(row), {static_cast<int>(arguments)...}, 0});
}

int keep_number(const mu::char_type* text, int* position, double* node) {
  const std::string_view s(text);
  if (s.empty() || !((s[0] >= '0' && s[0] <= '9') || s[0] == '.')) return 0;
  double value = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  if (error != std::errc{}) return 0;
  *position += static_cast<int>(end - s.data());
  *node = keep({-2, {}, value});
  return 1;
}

class Reader final : public mu::ParserBase {
 public:
  explicit Reader(std::vector<Expression::Node>& nodes) {
    record = &nodes;
    EnableOptimizer(false);
    EnableBuiltInOprt(false);
    AddValIdent(keep_number);
    InitCharSets();
    InitFun();
    InitConst();
    InitOprt();
    time_ = keep({-1, {}, 0});
    DefineVar("t", &time_);
  }
  ~Reader() override { record = nullptr; }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  void InitCharSets() override {
    DefineNameChars("0123456789_abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ");
    DefineOprtChars("+-*/^<>=!&|");
    DefineInfixOprtChars("+-");
  }
  void InitFun() override { define_all(std::make_index_sequence<std::size(operations)>()); }
  void InitConst() override {
    for (const auto& [name, value] : constants) DefineConst(name, keep({-2, {}, value}));
  }
  void InitOprt() override {}

 private:
  template <size_t... rows>
  void define_all(std::index_sequence<rows...>) {
    (define<rows>(), ...);
  }
  template <size_t row>
  void define() {
    constexpr Operation o = operations[row];
    const std::string name(o.name);
    if constexpr (o.precedence >= 0) {
      const auto side = o.precedence == mu::prPOW ? mu::oaRIGHT : mu::oaLEFT;
      DefineOprt(name, &keep_operation<row, double, double>, static_cast<unsigned>(o.precedence), side);
    } else if constexpr (o.precedence == -2) {
      DefineInfixOprt(name, &keep_operation<row, double>, mu::prINFIX, false);
    } else if constexpr (o.arguments == 1) {
      DefineFun(name, &keep_operation<row, double>, false);
    } else if constexpr (o.arguments == 2) {
      DefineFun(name, &keep_operation<row, double, double>, false);
    } else {
      DefineFun(name, &keep_operation<row, double, double, double>, false);
    }
  }

  double time_ = 0;
};

/// Number of letters to add, drop or change.
size_t distance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = std::exchange(row[0], i);
    for (size_t j = 1; j <= b.size(); ++j)
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1])}));
  }
  return row.back();
}

std::string suggestion(const std::string& token) {
  const auto end = std::ranges::find_if(token, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
  const std::string name(token.begin(), end);
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0]))) return "";
  const std::vector<std::string> known = expression_names();
  const auto near = std::ranges::min_element(
      known, {}, [&](const std::string& k) { return 2 * distance(name, k) + (k[0] != name[0]); });
  if (2 * distance(name, *near) > name.size() + 2)  // it is another word
    return fmt::format("; '{}' is not known; there are {}", name, fmt::join(known, ", "));
  return fmt::format("; '{}' is not known, the nearest name is '{}'", name, *near);
}

[[noreturn]] void refuse(const std::string& text, size_t column, const std::string& what) {
  throw InputError(fmt::format("expression \"{}\", column {}: {}", text, column, what));
}

/// A node that is slope * t + value, where that is known.
struct Line {
  double slope = 0, value = 0;
  bool is_known = false;
};

Line line_of(const Operation& o, const Line* x) {
  const bool both = x[0].is_known && (o.arguments < 2 || x[1].is_known);
  if (!both || o.arguments > 2) return {};
  const auto is_constant = [&](int k) { return k >= o.arguments || x[k].slope == 0; };
  if (is_constant(0) && is_constant(1)) {
    const Jet values[] = {{x[0].value}, {x[1].value}, {}};
    return {0, o.at(values).v, true};
  }
  if (o.name == "+" && o.arguments == 1) return x[0];
  if (o.name == "-" && o.arguments == 1) return {-x[0].slope, -x[0].value, true};
  if (o.name == "+") return {x[0].slope + x[1].slope, x[0].value + x[1].value, true};
  if (o.name == "-") return {x[0].slope - x[1].slope, x[0].value - x[1].value, true};
  if (o.name == "*" && is_constant(0)) return {x[0].value * x[1].slope, x[0].value * x[1].value, true};
  if (o.name == "*" && is_constant(1)) return {x[0].slope * x[1].value, x[0].value * x[1].value, true};
  if (o.name == "/" && is_constant(1)) return {x[0].slope / x[1].value, x[0].value / x[1].value, true};
  return {};
}

/// Has a node sides, which change where its first argument crosses the second, or zero? "==" and "!=" are on another
/// side for one moment, which does nothing.
bool has_sides(const Operation& o) {
  constexpr std::string_view names[] = {"<", ">", "<=", ">=", "abs", "sign", "step", "min", "max"};
  return std::ranges::find(names, o.name) != std::end(names);
}

bool compares_two(const Operation& o) { return o.arguments == 2; }
bool gives_flag(const Operation& o) { return o.precedence == mu::prCMP || o.name == "step"; }

/// Adds up to `most` first times of other sides within (a, b]: round-off may make many. side_at(t): what compares.
template <class SideAt>
void add_changes(const SideAt& side_at, double a, double b, size_t most, std::vector<double>& times) {
  const auto at_b = side_at(b);
  for (auto at_a = side_at(a); at_a != at_b && most > 0; at_a = side_at(a), --most) {
    double same = a, other = b;
    for (double middle = 0.5 * (same + other); same < middle && middle < other; middle = 0.5 * (same + other))
      (side_at(middle) == at_a ? same : other) = middle;
    times.push_back(a = other);
  }
}

}  // namespace

Expression::Expression(const std::string& text) {
  if (text.find_first_not_of(" \t") == std::string::npos) refuse(text, 1, "there is nothing here");
  if (const size_t at = text.find_first_of("?\"'"); at != std::string::npos)
    refuse(text, at + 1, fmt::format("'{}' is not known; write a choice as if(condition, then, else)", text[at]));
  Reader reader(nodes_);
  try {
    reader.SetExpr(text);
    result_ = static_cast<int>(reader.Eval());
    if (reader.GetNumResults() != 1) refuse(text, text.find(',') + 1, "one value is wanted, not a list");
  } catch (const mu::ParserError& e) {
    const bool unknown = e.GetCode() == mu::ecUNASSIGNABLE_TOKEN;
    refuse(text, static_cast<size_t>(std::max(0, e.GetPos())) + 1,
           unknown ? fmt::format("'{}' is not understood{}", e.GetToken(), suggestion(e.GetToken())) : e.GetMsg());
  }
}

namespace {

using Jets = std::array<Jet, max_nodes>;

void evaluate(const std::vector<Expression::Node>& nodes, double t, Jets& value) {
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Expression::Node& n = nodes[i];
    if (n.operation >= 0) {
      Jet x[3];
      for (int k = 0; k < operations[n.operation].arguments; ++k)
        x[k] = value[static_cast<size_t>(n.argument[static_cast<size_t>(k)])];
      value[i] = operations[n.operation].at(x);
    } else {
      value[i] = n.operation == -1 ? Jet{t, 1, 0} : Jet{n.constant, 0, 0};
    }
  }
}

}  // namespace

std::array<double, 3> Expression::at(double t) const {
  Jets value;  // NOLINT: written before it is read
  evaluate(nodes_, t, value);
  const Jet& r = value[static_cast<size_t>(result_)];
  return {r.v, r.d, r.dd};
}

std::vector<double> Expression::corners(double begin, double end, int samples) const {
  std::vector<Line> lines(nodes_.size());
  std::vector<size_t> curved;  // nodes whose sides change where no line says
  std::vector<double> times;
  const auto argument = [this](size_t i, size_t k) { return static_cast<size_t>(nodes_[i].argument[k]); };
  const auto side_of = [&](size_t i, const Jets& value) {  // zero belongs to that side which the result has there
    if (gives_flag(operations[nodes_[i].operation])) return value[i].v != 0;
    return value[argument(i, 0)].v > (compares_two(operations[nodes_[i].operation]) ? value[argument(i, 1)].v : 0);
  };
  Jets value;  // NOLINT: written before it is read
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const Node& n = nodes_[i];
    if (n.operation < 0) {
      lines[i] = n.operation == -1 ? Line{1, 0, true} : Line{0, n.constant, true};
      continue;
    }
    const Operation& o = operations[n.operation];
    const Line x[] = {lines[argument(i, 0)], lines[argument(i, 1)]};
    lines[i] = line_of(o, x);
    if (!has_sides(o)) continue;
    const Line other = compares_two(o) ? x[1] : Line{0, 0, true};
    if (!x[0].is_known || !other.is_known) {
      curved.push_back(i);
      continue;
    }
    const double zero = (other.value - x[0].value) / (x[0].slope - other.slope);
    if (!(begin < zero && zero < end)) continue;
    const auto side_at = [&](double t) {
      evaluate(nodes_, t, value);
      return side_of(i, value);
    };
    double near = 1e-12 * std::abs(zero) + 1e-300;
    while (side_at(zero - near) == side_at(zero + near) && near < end - begin) near *= 10;  // large terms cancel
    add_changes(side_at, zero - near, zero + near, 1, times);
  }
  const auto sides_at = [&](double t) {
    evaluate(nodes_, t, value);
    std::vector<bool> sides;
    for (const size_t i : curved) sides.push_back(side_of(i, value));
    return sides;
  };
  const auto sample = [&](int k) { return begin + k * (end - begin) / samples; };
  for (int k = 1; k <= samples && !curved.empty(); ++k)
    add_changes(sides_at, sample(k - 1), sample(k), curved.size(), times);
  std::erase_if(times, [&](double t) { return !(begin < t && t < end); });
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

std::vector<std::string> expression_names() {
  std::vector<std::string> names = {"t"};
  for (const auto& [name, value] : constants) names.emplace_back(name);
  for (const Operation& o : operations)
    if (o.precedence == -1) names.emplace_back(o.name);
  return names;
}

}  // namespace flexboom
