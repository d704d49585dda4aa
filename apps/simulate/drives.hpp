#pragma once

#include "apps/scene/scene.hpp"
#include "dynamics/model/time_function.hpp"

#include <complex>
#include <functional>
#include <vector>

namespace flexboom {

/// A function of time that drives a scene: a force, a torque or a prescribed motion.
struct Drive {
  const CourseScene* given = nullptr;  // in the scene
  TimeCourse course;
  bool is_motion = false;

  /// What vibrations feel of it: itself, of a motion its acceleration.
  const std::function<double(double)>& felt() const {
    return is_motion ? course.function.acceleration : course.function.value;
  }
};

/// Of joints, loads and wheels. Constants are none. @throws InputError as course_of.
std::vector<Drive> drives_of(const Scene&);

/// When each of them is largest, and in both directions, ascending [s]; a formula is looked at so many times.
std::vector<double> times_of_extremes(const std::vector<Drive>&, double duration, int samples);

/// Where it is not smooth, ascending [s]; a formula is looked at so many times.
std::vector<double> corners_of(const Drive&, double duration, int samples);

/// How many times drives are looked at before a flight: at each output and between, and in each row of a table.
int samples_of(const Scene&, const std::vector<Drive>&);

/// A mode feels a tone so many times its frequency away, at most, for what holds a body shifts its frequencies.
inline constexpr double beyond_a_tone = 1.3;

/// The sums of value_i exp(-i w t_i), t at equal steps, for w from 0 by pi over a duration of 2^n steps.
std::vector<std::complex<double>> spectral_sums(const std::vector<double>& values);

/// How strongly the drives of a scene move vibrations of each frequency.
///
/// An undamped vibration of frequency w under f(t) has the amplitude A / w^2 beside its static part f / w^2, where A is
/// |f(0) + integral of f' exp(i w t) dt|. A step gives one A to all frequencies, noise and pulses one A / w. So what
/// some modes show is an upper bound for those beyond. The same holds of a square wave of which they show three
/// harmonics. A tone has a peak beyond, which they do not show.
class DriveSpectra {
 public:
  explicit DriveSpectra(const Scene&);

  bool empty() const { return spectra_.empty(); }

  /// The highest frequency beyond `shown` at which a drive moves modes by more than those up to there let expect, and
  /// by more than a tenth of the tolerance of what it moves below [rad/s]. 0: none. `lowest`: of the body [rad/s].
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
