#pragma once

#include <string>
#include <vector>

namespace flexboom {

struct Curve {
  std::string name;
  std::vector<double> x, y;
};

struct Plot {
  std::string title, x_label, y_label;
  std::vector<Curve> curves;
  int width = 760, height = 280;
  bool log_x = false, log_y = false;
  bool markers = false;  // a dot at every value
};

/// A plot of measured points, its values on a logarithmic scale.
Plot plot_of_points(std::string title, std::string x_label, std::string y_label);

/// Adds a point to a curve, which is made with its first point. What is not finite is left out.
void add_point(Plot&, const std::string& curve, double x, double y);

/// Text that can stand between the tags of XML and HTML.
std::string escaped(const std::string&);

/// A line plot as one <svg> element: axes with round ticks, a legend, at most about 2000 points a curve (extremes of
/// each bin are kept).
std::string svg(const Plot&);

/// Plots one below the other, those without curves left out, as one <svg> element.
std::string stacked(const std::vector<Plot>&);

}  // namespace flexboom
