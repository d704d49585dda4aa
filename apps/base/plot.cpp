#include "apps/base/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace flexboom {

namespace {

constexpr std::array<const char*, 10> colours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00",
                                                 "#56b4e9", "#000000", "#7f3c8d", "#80852d", "#8c564b"};
constexpr const char* dashes = " stroke-dasharray=\"6 3\"";
constexpr double left = 78, right = 150, top = 30, bottom = 44;

struct Axis {
  double low = 0, high = 1;
  bool log = false;
  double fraction(double v) const { return ((log ? std::log10(v) : v) - low) / (high - low); }
};

Axis plot_axis(const std::vector<Curve>& curves, bool of_x, bool log) {
  Axis a{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), log};
  for (const Curve& c : curves)
    for (const double v : of_x ? c.x : c.y) {
      if (log && v <= 0) continue;
      a.low = std::min(a.low, log ? std::log10(v) : v);
      a.high = std::max(a.high, log ? std::log10(v) : v);
    }
  const double round_off = 1e-12 * std::max(std::abs(a.low), std::abs(a.high));
  if (!(a.high - a.low > round_off)) {
    const double centre = std::isfinite(a.low) ? a.low : 0.0, half = std::max(1e-12, std::abs(centre) * 0.1);
    a.low = centre - half, a.high = centre + half;
  } else if (!of_x) {
    const double margin = 0.05 * (a.high - a.low);
    a.low -= margin, a.high += margin;
  }
  return a;
}

std::vector<double> round_ticks(const Axis& a) {
  const double span = a.high - a.low;
  const double raw = span / 5, power = std::pow(10, std::floor(std::log10(raw)));
  const double m = raw / power, step = std::max(a.log ? 1.0 : 0.0, power * (m < 1.5   ? 1
                                                                            : m < 3.5 ? 2
                                                                            : m < 7.5 ? 5
                                                                                      : 10));
  std::vector<double> ticks;
  for (double k = std::ceil(a.low / step); k * step <= a.high * (1 + 1e-12) + 1e-300; ++k) ticks.push_back(k * step);
  return ticks;
}

std::string label(const Axis& a, double tick) {
  if (a.log) return fmt::format("1e{:g}", tick);
  return fmt::format("{:.4g}", std::abs(tick) < 1e-12 * std::max(std::abs(a.low), std::abs(a.high)) ? 0.0 : tick);
}

/// Indices to draw: all, or first, lowest, highest, last of each of `bins` bins.
std::vector<size_t> thinned(const std::vector<double>& y, size_t bins) {
  std::vector<size_t> keep;
  if (y.size() <= 4 * bins) {
    for (size_t i = 0; i < y.size(); ++i) keep.push_back(i);
    return keep;
  }
  for (size_t b = 0; b < bins; ++b) {
    const size_t begin = b * y.size() / bins, end = (b + 1) * y.size() / bins;
    const auto from = y.begin() + static_cast<std::ptrdiff_t>(begin), to = y.begin() + static_cast<std::ptrdiff_t>(end);
    const auto [low, high] = std::minmax_element(from, to);
    std::array<size_t, 4> some = {begin, static_cast<size_t>(low - y.begin()), static_cast<size_t>(high - y.begin()),
                                  end - 1};
    std::sort(some.begin(), some.end());
    keep.insert(keep.end(), some.begin(), std::unique(some.begin(), some.end()));
  }
  return keep;
}

}  // namespace

Plot plot_of_points(std::string title, std::string x_label, std::string y_label) {
  Plot plot;
  plot.title = std::move(title), plot.x_label = std::move(x_label), plot.y_label = std::move(y_label);
  plot.log_y = plot.markers = true;
  plot.height = 330;
  return plot;
}

void add_point(Plot& plot, const std::string& name, double x, double y) {
  if (!std::isfinite(y)) return;
  auto curve = std::ranges::find(plot.curves, name, &Curve::name);
  if (curve == plot.curves.end()) curve = plot.curves.insert(curve, Curve{name, {}, {}});
  curve->x.push_back(x);
  curve->y.push_back(y);
}

std::string escaped(const std::string& s) {
  std::string r;
  for (const char c : s) r += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return r;
}

std::string svg(const Plot& p) {
  const Axis ax = plot_axis(p.curves, true, p.log_x), ay = plot_axis(p.curves, false, p.log_y);
  const double w = p.width - left - right, h = p.height - top - bottom;
  const auto px = [&](double fraction) { return left + w * fraction; };
  const auto py = [&](double fraction) { return top + h * (1 - fraction); };
  std::string s = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" "
      "font-size=\"12\"><rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
      p.width, p.height);
  s += fmt::format("<text x=\"{:.0f}\" y=\"18\" font-size=\"14\" font-weight=\"bold\">{}</text>\n", left,
                   escaped(p.title));
  for (const double t : round_ticks(ax)) {
    const double x = px((t - ax.low) / (ax.high - ax.low));
    s += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}V{2:.1f}\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" y=\"{3:.1f}\" "
        "text-anchor=\"middle\">{4}</text>\n",
        x, top, top + h, top + h + 16, label(ax, t));
  }
  for (const double t : round_ticks(ay)) {
    const double y = py((t - ay.low) / (ay.high - ay.low));
    s += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}H{2:.1f}\" stroke=\"#ddd\"/><text x=\"{3:.1f}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5}</text>\n",
        left, y, left + w, left - 6, y + 4, label(ay, t));
  }
  s += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#888\"/>\n", left, top, w,
                   h);
  s += fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" text-anchor=\"middle\">{}</text>\n", left + w / 2, p.height - 8.0,
                   escaped(p.x_label));
  s += fmt::format("<text transform=\"translate(14 {:.0f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                   top + h / 2, escaped(p.y_label));
  for (size_t i = 0; i < p.curves.size(); ++i) {
    const Curve& c = p.curves[i];
    const char* colour = colours[i % colours.size()];
    // every other curve is dashed, so that two that coincide are both seen
    s += fmt::format(R"(<polyline fill="none" stroke="{}" stroke-width="1.3"{} points=")", colour, i % 2 ? dashes : "");
    for (const size_t k : thinned(c.y, 500)) {
      if ((p.log_x && c.x[k] <= 0) || (p.log_y && c.y[k] <= 0)) continue;
      s += fmt::format("{:.1f},{:.1f} ", px(ax.fraction(c.x[k])), py(ay.fraction(c.y[k])));
    }
    s += "\"/>\n";
    for (size_t k = 0; p.markers && k < c.x.size(); ++k) {
      if ((p.log_x && c.x[k] <= 0) || (p.log_y && c.y[k] <= 0)) continue;
      s += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", px(ax.fraction(c.x[k])),
                       py(ay.fraction(c.y[k])), colour);
    }
    const double y = top + 10 + 18 * static_cast<double>(i);
    s += fmt::format(
        "<path d=\"M{0:.0f} {1:.0f}h18\" stroke=\"{2}\" stroke-width=\"2\"{6}/><text x=\"{3:.0f}\" "
        "y=\"{4:.0f}\">{5}</text>\n",
        left + w + 8, y, colour, left + w + 30, y + 4, escaped(c.name), i % 2 ? dashes : "");
  }
  return s + "</svg>\n";
}

std::string stacked(const std::vector<Plot>& plots) {
  int height = 0;
  std::string content;
  for (const Plot& plot : plots) {
    if (plot.curves.empty()) continue;
    content += fmt::format("<g transform=\"translate(0 {})\">{}</g>\n", height, svg(plot));
    height += plot.height;
  }
  const int width = Plot{}.width;
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\">\n"
      "{2}</svg>\n",
      width, height, content);
}

}  // namespace flexboom
