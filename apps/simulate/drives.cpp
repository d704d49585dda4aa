#include "apps/simulate/drives.hpp"

#include "apps/scene/wanted_accuracy.hpp"
#include "apps/simulate/output_errors.hpp"

#include <unsupported/Eigen/FFT>

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

namespace flexboom {

namespace {

using Reals = std::vector<double>;

/// Values of a function at so many equal steps of a duration, and at its end.
Reals sampled(const std::function<double(double)>& f, double duration, size_t steps) {
  Reals values(steps + 1);
  for (size_t i = 0; i <= steps; ++i) values[i] = f(duration * static_cast<double>(i) / static_cast<double>(steps));
  return values;
}

double largest(const Reals& values) {
  double most = 0;
  for (const double v : values) most = std::max(most, std::abs(v));
  return most;
}

/// Do cubics through every second of these values follow the others, but for a few corners and jumps?
bool is_resolved(const Reals& v) {
  constexpr double negligible = 1e-6;
  constexpr size_t corners = 16;
  const double allowed = negligible * largest(v);
  size_t others = 0;
  for (size_t i = 3; i + 3 < v.size(); i += 2)
    if (!(std::abs((9 * (v[i - 1] + v[i + 1]) - v[i - 3] - v[i + 3]) / 16 - v[i]) <= allowed)) ++others;
  return others <= corners;
}

/// |sum of value_i exp(-i w t_i)|, t at equal steps, for w from 0 by pi / duration.
Reals transform(const Reals& values) {
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  Reals padded(values);
  padded.resize(2 * std::bit_floor(values.size()), 0.0);
  std::vector<std::complex<double>> sums;
  fft.fwd(sums, padded);
  Reals sizes(sums.size());
  std::ranges::transform(sums, sizes.begin(), [](std::complex<double> z) { return std::abs(z); });
  return sizes;
}

}  // namespace

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

DriveSpectra::DriveSpectra(const Scene& scene) {
  constexpr double of_tolerance = 0.1;
  share_ = of_tolerance * scene.tolerance;
  const std::vector<Drive> drives = drives_of(scene);
  const int samples = drives.empty() ? 0 : samples_of(scene, drives);
  for (const Drive& d : drives)
    if (!d.given->manoeuvre) spectra_.push_back(spectrum_of(d, scene.duration, samples));
}

DriveSpectra::Spectrum DriveSpectra::spectrum_of(const Drive& drive, double duration, int samples) {
  constexpr size_t most = 1 << 18;
  Reals f = sampled(drive.felt(), duration, static_cast<size_t>(samples));
  while (!drive.given->table && f.size() < most && !is_resolved(f))
    f = sampled(drive.felt(), duration, 2 * f.size() - 2);
  Spectrum s;
  s.step = std::numbers::pi / duration;
  const double size = largest(f);
  if (!(size > 0 && std::isfinite(size))) return s;
  const double steps = static_cast<double>(f.size() - 1);
  Reals changes(f.size());
  changes[0] = f[0];
  for (size_t i = 1; i < f.size(); ++i) changes[i] = f[i] - f[i - 1];
  s.strength = transform(changes);
  s.content = transform(f);
  for (double& a : s.strength) a /= size;
  for (double& a : s.content) a *= 2 / (steps * size);
  return s;
}

double DriveSpectra::fastest_beyond(double lowest, double shown) const {
  constexpr double more = 4, band = 8, nearly_all = 0.95;
  double fastest = 0;
  for (const Spectrum& s : spectra_) {
    const auto bin_of = [&](double w) { return std::min(static_cast<size_t>(w / s.step), s.strength.size()); };
    const size_t first = std::max<size_t>(bin_of(shown / band), 1), end = bin_of(shown);
    double below = 0;  // what the drive moves there: quasi-static up to the lowest frequency, then as 1 / w
    for (size_t i = 0; i < end; ++i)
      below = std::max(below, s.content[i] / std::max(lowest, static_cast<double>(i) * s.step));
    Reals level;
    for (size_t i = first; i < end; ++i) level.push_back(s.strength[i] / static_cast<double>(i));
    double expected = 0;
    if (!level.empty()) {
      const auto high = level.begin() + static_cast<std::ptrdiff_t>(nearly_all * static_cast<double>(level.size() - 1));
      std::ranges::nth_element(level, high);
      expected = *high;
    }
    for (size_t i = s.strength.size(); i-- > std::max<size_t>(end, 1);) {
      const double w = static_cast<double>(i) * s.step, strength = s.strength[i];
      if (w <= fastest) break;
      if (strength / static_cast<double>(i) <= more * expected) continue;
      if (strength / w <= share_ * std::max(below, s.content[i] / w)) continue;
      fastest = w;
      break;
    }
  }
  return fastest;
}

}  // namespace flexboom
