#pragma once

#include "apps/scene/scene.hpp"
#include "dynamics/model/time_function.hpp"

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

}  // namespace flexboom
