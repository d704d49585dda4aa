#pragma once

#include "dynamics/events/laws.hpp"
#include "dynamics/relative/tree.hpp"

#include <memory>
#include <span>

namespace flexboom {

/// What an integrator sees of a system: y' = f(t, y), smooth while the contacts stay. Holds a workspace: for one
/// thread.
class Ode {
 public:
  virtual ~Ode() = default;
  /// The same equations with a workspace of its own.
  virtual std::unique_ptr<Ode> another() const = 0;
  virtual int size() const = 0;
  virtual int stops() const = 0;
  /// contact: one flag per stop.
  virtual void derivative(double t, const double* y, std::span<const char> contact, double* y_dot) = 0;
  /// Keeps J = df/dy there.
  virtual void jacobian(double t, const double* y, std::span<const char> contact) = 0;
  /// Prepares solves with I - gamma J. @throws NumericalError when it is not finite.
  virtual void factorise(double gamma) = 0;
  /// x = (I - gamma J)^-1 b; both may be the same array.
  virtual void solve(const double* b, double* x) = 0;
  /// How far beyond its stop a hinge is, and the rate of that (of y) or its acceleration (of y_dot).
  virtual double gap(const double* y, int stop) const = 0;
  virtual double gap_rate(const double* y, int stop) const = 0;
  /// Of the switches of laws, which are numbered behind the stops.
  virtual Gap switch_gap(double /*t*/, const double* /*y*/, int /*number*/) { return {}; }
};

/// laws: as they are whenever the equations are asked.
std::unique_ptr<Ode> ode_of(const Tree&, const Laws& laws);

}  // namespace flexboom
