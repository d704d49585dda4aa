#include "apps/simulate/drives.hpp"

#include "dynamics/numerics/expression.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <optional>
#include <string>

namespace flexboom {

std::vector<Drive> drives_of(const Scene& scene) {
  std::vector<Drive> drives;
  const auto add = [&](const CourseScene& c, bool is_motion) {
    const bool is_number = !c.expression.empty() && c.expression.find('t') == std::string::npos;
    if (c.given() && !is_number) drives.push_back({&c, course_of(c, scene.duration), is_motion});
  };
  for (const JointScene& j : scene.joints) {
    add(j.drive, false);
    for (const CourseScene& c : j.motion) add(c, true);
  }
  for (const LoadScene& l : scene.loads)
    for (size_t i = 0; i < 3; ++i) add(l.force[i], false), add(l.torque[i], false);
  for (const WheelScene& w : scene.wheels) add(w.torque, false);
  return drives;
}

std::vector<double> corners_of(const Drive& drive, double duration, int samples) {
  std::vector<double> corners = drive.course.corners;
  if (const std::string& formula = drive.given->expression; !formula.empty())
    corners = Expression(formula).corners(0, duration, samples);
  std::ranges::sort(corners);
  return corners;
}

std::vector<double> times_of_extremes(const std::vector<Drive>& drives, double duration, int samples) {
  std::vector<double> times;
  for (const Drive& d : drives) {
    const std::vector<double> corners = corners_of(d, duration, samples);
    std::vector<double> looks;  // between corners a pulse may be shorter than the samples
    for (int i = 0; i <= samples; ++i) looks.push_back(duration * i / samples);
    const auto in_flight = [duration](double t) { return std::clamp(t, 0.0, duration); };
    for (size_t i = 1; i < corners.size(); ++i)
      looks.push_back(0.5 * (in_flight(corners[i - 1]) + in_flight(corners[i])));
    std::vector<double> values;
    for (const double t : looks) values.push_back(d.felt()(t));
    const auto [least, most] = std::ranges::minmax_element(values);
    for (const auto& extreme : {least, most}) times.push_back(looks[static_cast<size_t>(extreme - values.begin())]);
  }
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

int samples_of(const Scene& scene, const std::vector<Drive>& drives) {
  constexpr double most = 1 << 20;
  double samples = std::max(4096.0, 4 * scene.duration / scene.output_step);
  for (const Drive& d : drives) {
    const std::optional<TimeTable>& table = d.given->table;
    for (size_t i = 1; table && i < table->time.size(); ++i)
      samples = std::max(samples, 2 * scene.duration / (table->time[i] - table->time[i - 1]));
  }
  return static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::min(samples, most))));
}

}  // namespace flexboom
