#include "apps/accuracy/drive_spectra.hpp"

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

/// Do cubics through these values follow the function between them, but near its corners and in a few other places? It
/// is looked at in places that follow no period, for a tone looks slow where it has the period of the looks.
bool is_resolved(const Reals& v, const std::function<double(double)>& f, double duration, const Reals& corners) {
  constexpr double negligible = 1e-6;
  constexpr size_t few = 16;
  const double allowed = negligible * largest(v), step = duration / static_cast<double>(v.size() - 1);
  size_t others = 0;
  for (size_t i = 1; i + 2 < v.size() && others <= few; ++i) {
    const auto corner = std::ranges::lower_bound(corners, static_cast<double>(i - 1) * step);
    if (corner != corners.end() && *corner <= static_cast<double>(i + 2) * step) continue;
    const double place = static_cast<double>(i) * std::numbers::phi, x = 0.1 + 0.8 * (place - std::floor(place));
    const double cubic = -x * (x - 1) * (x - 2) / 6 * v[i - 1] + (x + 1) * (x - 1) * (x - 2) / 2 * v[i] -
                         (x + 1) * x * (x - 2) / 2 * v[i + 1] + (x + 1) * x * (x - 1) / 6 * v[i + 2];
    if (!(std::abs(cubic - f((static_cast<double>(i) + x) * step)) <= allowed)) ++others;
  }
  return others <= few;
}

using Sums = std::vector<std::complex<double>>;

Reals sizes(const Sums& sums, double scale) {
  Reals r(sums.size());
  std::ranges::transform(sums, r.begin(), [scale](std::complex<double> z) { return scale * std::abs(z); });
  return r;
}

/// The same of values under Hann's window: a tone has hardly any side lobes there.
Sums windowed(const Sums& sums) {
  Sums r(sums);
  for (size_t i = 2; i + 2 < sums.size(); ++i) r[i] = sums[i] - (sums[i - 2] + sums[i + 2]) / 2.0;
  return r;
}

/// The third highest peak of these values from `first` to `end`, peaks as wide as those of tones under the window. One
/// tone, or two, are no rule for others; harmonics of a period are.
double third_peak(const Reals& values, size_t first, size_t end) {
  constexpr size_t width = 4;
  std::vector<size_t> peaks;
  for (int n = 0; n < 3; ++n) {
    size_t best = end;
    for (size_t i = first; i < end; ++i) {
      const auto is_beside = [i](size_t peak) { return std::max(i, peak) - std::min(i, peak) <= width; };
      if ((best == end || values[i] > values[best]) && std::ranges::none_of(peaks, is_beside)) best = i;
    }
    if (best == end) return 0;
    peaks.push_back(best);
  }
  return values[peaks.back()];
}

}  // namespace

std::vector<std::complex<double>> spectral_sums(const std::vector<double>& values) {
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  Reals padded(values);
  padded.resize(2 * std::bit_floor(values.size()), 0.0);
  Sums sums;
  fft.fwd(sums, padded);
  return sums;
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
  const Reals corners = corners_of(drive, duration, samples);
  while (!drive.given->table && f.size() < most && !is_resolved(f, drive.felt(), duration, corners))
    f = sampled(drive.felt(), duration, 2 * f.size() - 2);
  Spectrum s;
  s.step = std::numbers::pi / duration;
  const double size = largest(f);
  if (!(size > 0 && std::isfinite(size))) return s;
  const double steps = static_cast<double>(f.size() - 1);
  Reals changes(f.size());
  changes[0] = f[0];
  for (size_t i = 1; i < f.size(); ++i) changes[i] = f[i] - f[i - 1];
  const Sums sums = spectral_sums(changes);
  s.strength = sizes(sums, 1 / size);
  s.repeated = sizes(windowed(sums), 1 / size);
  s.content = sizes(spectral_sums(f), 2 / (steps * size));
  for (size_t i = 1; i < s.repeated.size(); ++i) s.repeated[i] /= static_cast<double>(i);
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
    double expected = third_peak(s.repeated, first, end);
    if (!level.empty()) {
      const auto high = level.begin() + static_cast<std::ptrdiff_t>(nearly_all * static_cast<double>(level.size() - 1));
      std::ranges::nth_element(level, high);
      expected = std::max(expected, *high);
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
