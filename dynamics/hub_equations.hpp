#pragma once

// The equations of motion of a hub with hinged flexible bodies (README, "Equations of motion"). Internal to `dynamics`.

#include "dynamics/equations.hpp"
#include "dynamics/quad.hpp"

#include <array>
#include <span>
#include <vector>

namespace flexboom::equations {

/// Bodies that are computed side by side: four that are alike in the number of their modes, or one.
template <class C>
struct SideBySide {
  BodyOf<C> body;
  std::array<int, lanes_of<C>> at{};      // first entry in p; places that are left over repeat the last body
  std::array<int, lanes_of<C>> number{};  // of the body
  int count = 0;
};

struct Model {
  double hub_m = 0;
  Vec3<double> hub_mc;
  Sym3<double> hub_J;
  bool fixed_hub = false;
  std::vector<SideBySide<double>> singles;
  std::vector<SideBySide<Quad>> quads;

  int base() const { return fixed_hub ? 0 : 3; }  // entries of omega in u
};

/// Calls f with each of a model's bodies, and what a scratch has for them.
template <class M, class S, class F>
void for_each_side_by_side(M& model, S& scratch, F f) {
  for (size_t i = 0; i < model.singles.size(); ++i) f(model.singles[i], scratch.singles[i]);
  for (size_t i = 0; i < model.quads.size(); ++i) f(model.quads[i], scratch.quads[i]);
}

/// Of bodies side by side: their part of the state and of its derivative, and quantities between the sweeps.
template <class T>
struct SideBySideScratch {
  std::vector<T> p, u, out;  // 1 + n each
  BodyScratch<T> body;

  explicit SideBySideScratch(int n)
      : p(static_cast<size_t>(1 + n)), u(p.size()), out(p.size()), body(static_cast<size_t>(n)) {}
};

/// T: of one body, of four.
template <class T, class T4>
struct Scratch {
  std::vector<SideBySideScratch<T>> singles;
  std::vector<SideBySideScratch<T4>> quads;

  explicit Scratch(const Model& model) {
    for (const auto& s : model.singles) singles.emplace_back(s.body.n);
    for (const auto& s : model.quads) quads.emplace_back(s.body.n);
  }
};

/// Copies the bodies' parts of p and u; without derivatives.
template <class C, class T>
void load(const SideBySide<C>& bodies, const double* p, const double* u, SideBySideScratch<T>& s) {
  for (size_t k = 0; k < s.p.size(); ++k) {
    s.p[k] = T(), s.u[k] = T();
    for (int i = 0; i < lanes_of<C>; ++i) {
      const size_t from = static_cast<size_t>(bodies.at[static_cast<size_t>(i)]) + k;
      set_lane(s.p[k], i, p[from]);
      set_lane(s.u[k], i, u[from]);
    }
  }
}

template <class C>
C closed_stops(const SideBySide<C>& bodies, std::span<const char> contact) {
  C closed = 0;
  for (int i = 0; i < lanes_of<C>; ++i)
    set_lane(closed, i, contact[static_cast<size_t>(bodies.number[static_cast<size_t>(i)])] ? 1 : 0);
  return closed;
}

template <class C>
double sum(const C& a, int count) {
  double s = 0;
  for (int i = 0; i < count; ++i) s += lane(a, i);
  return s;
}

template <class C>
Vec3<double> sum(const Vec3<C>& a, int count) {
  return {sum(a.x, count), sum(a.y, count), sum(a.z, count)};
}
template <class C>
Sym3<double> sum(const Sym3<C>& a, int count) {
  return {sum(a.xx, count), sum(a.yy, count), sum(a.zz, count), sum(a.xy, count), sum(a.yz, count), sum(a.zx, count)};
}

/// `to` += what all the bodies add.
template <class C>
void add(const HubSystem<C>& part, int count, HubSystem<double>& to) {
  const auto& rows = part.tw.row;
  to += {sum(part.tt, count), sum(part.ww, count),
         Mat3<double>{{sum(rows[0], count), sum(rows[1], count), sum(rows[2], count)}}, sum(part.ft, count),
         sum(part.fw, count)};
}

/// The hub alone, before any body is added: mass matrix, and force at angular velocity w.
template <class T>
HubSystem<T> bare_hub(const Model& model, const Vec3<T>& w) {
  const Vec3<double>& c = model.hub_mc;
  const Sym3<double>& J = model.hub_J;
  const T zero(0.0);
  HubSystem<T> hub;
  hub.tt = {T(model.hub_m), T(model.hub_m), T(model.hub_m), zero, zero, zero};
  hub.tw = {{Vec3<T>{zero, T(c.z), T(-c.y)}, Vec3<T>{T(-c.z), zero, T(c.x)}, Vec3<T>{T(c.y), T(-c.x), zero}}};
  hub.ww = {T(J.xx), T(J.yy), T(J.zz), T(J.xy), T(J.yz), T(J.zx)};
  hub.ft = -cross(w, cross(w, c));
  hub.fw = -cross(w, J * w);
  return hub;
}

/// Of the hub with everything on it, about its origin, hub axes: acceleration, then angular acceleration.
inline Eigen::Matrix<double, 6, 6> mass_matrix(const HubSystem<double>& hub) {
  Eigen::Matrix<double, 6, 6> M;
  M.topLeftCorner<3, 3>() = spatial::eigen(hub.tt);
  M.bottomRightCorner<3, 3>() = spatial::eigen(hub.ww);
  for (int i = 0; i < 3; ++i) M.block<1, 3>(i, 3) = spatial::eigen(hub.tw.row[static_cast<size_t>(i)]).transpose();
  M.bottomLeftCorner<3, 3>() = M.topRightCorner<3, 3>().transpose();
  return M;
}

/// Force and torque of gravity on the hub alone, about its origin, hub axes.
struct GravityOnHub {
  Vec3<double> force, torque;
};
inline GravityOnHub gravity_on_hub(const Model& model, const Gravity<double>& field) {
  return {model.hub_m * field.acceleration + field.gradient * model.hub_mc,
          cross(model.hub_mc, field.acceleration) + gradient_torque(field.gradient, model.hub_J)};
}

/// Mass matrix and force of the hub with everything condensed to it, from p = (Delta, q)... and u = (omega, Delta_dot,
/// q_dot...). `field`: gravity about the hub's origin, hub axes, or null.
inline HubSystem<double> condensed_hub(const Model& model, const double* p, const double* u,
                                       std::span<const char> contact, Scratch<double, Quad>& scratch,
                                       const Gravity<double>* field) {
  const Vec3<double> w_hub = model.fixed_hub ? Vec3<double>{} : Vec3<double>{u[0], u[1], u[2]};
  HubSystem<double> hub = bare_hub(model, w_hub);
  if (field) {
    const GravityOnHub g = gravity_on_hub(model, *field);
    hub.ft += g.force, hub.fw += g.torque;
  }
  const double* rates = u + model.base();
  for_each_side_by_side(model, scratch, [&]<class C>(const SideBySide<C>& bodies, SideBySideScratch<C>& s) {
    load(bodies, p, rates, s);
    HubSystem<C> part;
    condense(bodies.body, lift<C>(w_hub), s.p.data(), s.u.data(), closed_stops(bodies, contact), s.body,
             model.fixed_hub, part, field);
    add(part, bodies.count, hub);
  });
  return hub;
}

/// u_dot and the acceleration of the hub's origin in hub axes, arguments as above.
inline void accelerations(const Model& model, const double* p, const double* u, std::span<const char> contact,
                          Scratch<double, Quad>& scratch, double* u_dot, Vec3<double>& a_hub,
                          const Gravity<double>* field = nullptr) {
  const HubSystem<double> hub = condensed_hub(model, p, u, contact, scratch, field);
  a_hub = {};
  Vec3<double> alpha_hub;
  if (!model.fixed_hub) {
    solve_hub(hub, a_hub, alpha_hub);
    u_dot[0] = alpha_hub.x, u_dot[1] = alpha_hub.y, u_dot[2] = alpha_hub.z;
  }
  double* out = u_dot + model.base();
  for_each_side_by_side(model, scratch, [&]<class C>(const SideBySide<C>& bodies, SideBySideScratch<C>& s) {
    release(bodies.body, s.body, a_hub, alpha_hub, s.out.data());
    for (size_t k = 0; k < s.out.size(); ++k)
      for (int i = 0; i < bodies.count; ++i)
        out[static_cast<size_t>(bodies.at[static_cast<size_t>(i)]) + k] = lane(s.out[k], i);
  });
}

/// Power of gravity on hub and bodies [W] with the loads that `accelerations` left in the scratch; v, w: of the hub,
/// hub axes.
inline double gravity_power(const Model& model, const Gravity<double>& field, const Scratch<double, Quad>& scratch,
                            const Vec3<double>& v, const Vec3<double>& w) {
  const GravityOnHub hub = gravity_on_hub(model, field);
  double power = dot(hub.force, v) + dot(hub.torque, w);
  for_each_side_by_side(model, scratch, [&]<class C>(const SideBySide<C>& bodies, const SideBySideScratch<C>& s) {
    power += sum(dot(s.body.gravity.force, v) + s.body.gravity.power, bodies.count);
  });
  return power;
}

/// Power lost in hinge dampers and structural damping [W]; u in the scratch.
inline double dissipated_power(const Model& model, const Scratch<double, Quad>& scratch) {
  double power = 0;
  for_each_side_by_side(model, scratch, [&]<class C>(const SideBySide<C>& bodies, const SideBySideScratch<C>& s) {
    const BodyOf<C>& b = bodies.body;
    const auto n = static_cast<size_t>(b.n);
    C lost = b.damping * s.u[0] * s.u[0];
    for (size_t k = 0; k < n; ++k)
      for (size_t l = b.row_begin(k); l < b.row_end(k); ++l) lost += s.u[1 + k] * b.De[k * n + l] * s.u[1 + l];
    power += sum(lost, bodies.count);
  });
  return power;
}

}  // namespace flexboom::equations
