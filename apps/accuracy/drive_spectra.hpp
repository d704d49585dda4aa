#pragma once

#include "apps/simulate/drives.hpp"

#include <complex>
#include <vector>

namespace flexboom {

/// A mode feels a tone so many times its frequency away, at most, for what holds a body shifts its frequencies.
inline constexpr double beyond_a_tone = 1.3;

/// The sums of value_i exp(-i w t_i), t at equal steps, for w from 0 by pi over a duration of 2^n steps.
std::vector<std::complex<double>> spectral_sums(const std::vector<double>& values);

/// How strongly the drives of a scene move vibrations of each frequency.
///
/// An undamped vibration of frequency w under f(t) has the amplitude A / w^2 beside its static part f / w^2. A is
/// |f(0) + integral of f' exp(i w t) dt|. A step gives one A to all frequencies, noise and pulses one A / w. So what
/// some modes show is an upper bound for those beyond. The same holds of a square wave of which they show three
/// harmonics. A tone has a peak beyond, which they do not show.
class DriveSpectra {
 public:
  explicit DriveSpectra(const Scene&);

  bool empty() const { return spectra_.empty(); }

  /// The highest frequency beyond `shown` at which a drive moves modes by more than those up to there let expect
  /// [rad/s]. It must move them by more than a tenth of the tolerance of what it moves below, too. 0: none. `lowest`:
  /// of the body [rad/s].
  double fastest_beyond(double lowest, double shown) const;

 private:
  struct Spectrum {
    double step = 0;               // [rad/s]
    std::vector<double> strength;  // A over the largest |f|, at 0, step, 2 step, ...
    std::vector<double> repeated;  // the same of what goes on all the time, over 0, 1, 2, ...
    std::vector<double> content;   // amplitude of f over its largest |f|
  };
  static Spectrum spectrum_of(const Drive&, double duration, int samples);

  std::vector<Spectrum> spectra_;
  double share_ = 0;
};

}  // namespace flexboom
