#include "dynamics/side_by_side.hpp"

#include <algorithm>
#include <map>
#include <tuple>

namespace flexboom {
namespace {

using equations::Body;
using equations::TermOf;
using spatial::Sym3;
using spatial::Vec3;
using Members = std::array<const Body*, Quad::width>;

/// The number that `of` finds in each body.
template <class F>
Quad number(const Members& bodies, F of) {
  Quad r;
  for (int i = 0; i < Quad::width; ++i) set_lane(r, i, of(*bodies[static_cast<size_t>(i)]));
  return r;
}

template <class F>
Vec3<Quad> vector(const Members& bodies, F of) {
  return {number(bodies, [&](const Body& b) { return of(b).x; }),
          number(bodies, [&](const Body& b) { return of(b).y; }),
          number(bodies, [&](const Body& b) { return of(b).z; })};
}

template <class F>
Sym3<Quad> symmetric(const Members& bodies, F of) {
  const auto entry = [&](double Sym3<double>::*e) { return number(bodies, [&](const Body& b) { return of(b).*e; }); };
  return {entry(&Sym3<double>::xx), entry(&Sym3<double>::yy), entry(&Sym3<double>::zz),
          entry(&Sym3<double>::xy), entry(&Sym3<double>::yz), entry(&Sym3<double>::zx)};
}

std::vector<Vec3<Quad>> vectors(const Members& bodies, std::vector<Vec3<double>> Body::*member) {
  std::vector<Vec3<Quad>> r;
  for (size_t k = 0; k < (bodies[0]->*member).size(); ++k)
    r.push_back(vector(bodies, [&](const Body& b) { return (b.*member)[k]; }));
  return r;
}

std::vector<Quad> numbers(const Members& bodies, std::vector<double> Body::*member) {
  std::vector<Quad> r;
  for (size_t k = 0; k < (bodies[0]->*member).size(); ++k)
    r.push_back(number(bodies, [&](const Body& b) { return (b.*member)[k]; }));
  return r;
}

/// Terms that any of the bodies has.
std::vector<TermOf<Quad>> terms(const Members& bodies, std::vector<equations::Term> Body::*member) {
  std::map<std::tuple<int, int, int>, Quad> values;
  for (int i = 0; i < Quad::width; ++i)
    for (const equations::Term& t : bodies[static_cast<size_t>(i)]->*member)
      set_lane(values[{t.k, t.l, t.component}], i, t.value);
  std::vector<TermOf<Quad>> r;
  for (const auto& [key, value] : values) r.push_back({std::get<0>(key), std::get<1>(key), std::get<2>(key), value});
  return r;
}

equations::BodyOf<Quad> side_by_side(const Members& b) {
  const auto scalar = [&b](double Body::*member) { return number(b, [=](const Body& x) { return x.*member; }); };
  equations::BodyOf<Quad> r;
  r.n = b[0]->n;
  r.m = scalar(&Body::m);
  r.mc0 = vector(b, [](const Body& x) { return x.mc0; });
  r.J0 = symmetric(b, [](const Body& x) { return x.J0; });
  r.Ct = vectors(b, &Body::Ct);
  r.Cr0 = vectors(b, &Body::Cr0);
  r.Cr1 = terms(b, &Body::Cr1);
  r.J1 = terms(b, &Body::J1);
  r.J2 = terms(b, &Body::J2);
  r.Ke = numbers(b, &Body::Ke);
  r.De = numbers(b, &Body::De);
  r.Me = numbers(b, &Body::Me);
  r.Me_inverse = numbers(b, &Body::Me_inverse);
  r.diagonal = std::ranges::all_of(b, [](const Body* x) { return x->diagonal; });
  r.Gt = vectors(b, &Body::Gt);
  r.Ctt = symmetric(b, [](const Body& x) { return x.Ctt; });
  r.d = vector(b, [](const Body& x) { return x.d; });
  for (size_t i = 0; i < 3; ++i) r.B.row[i] = vector(b, [i](const Body& x) { return x.B.row[i]; });
  r.cos_threshold = scalar(&Body::cos_threshold);
  r.sin_threshold = scalar(&Body::sin_threshold);
  r.stiffness = scalar(&Body::stiffness);
  r.preload = scalar(&Body::preload);
  r.damping = scalar(&Body::damping);
  r.stop_stiffness = scalar(&Body::stop_stiffness);
  return r;
}

}  // namespace

void place_side_by_side(std::vector<Body> bodies, const std::vector<int>& at, equations::Model& model) {
  std::vector<char> placed(bodies.size(), 0);
  for (size_t first = 0; first < bodies.size(); ++first) {
    if (placed[first]) continue;
    std::vector<size_t> alike;
    for (size_t i = first; i < bodies.size() && alike.size() < Quad::width; ++i)
      if (!placed[i] && bodies[i].n == bodies[first].n) alike.push_back(i), placed[i] = 1;
    const auto count = static_cast<int>(alike.size());
    if (count == 1) {
      model.singles.push_back({std::move(bodies[first]), {at[first]}, {static_cast<int>(first)}, 1});
      continue;
    }
    equations::SideBySide<Quad> set;
    set.count = count;
    alike.resize(Quad::width, alike.back());
    Members members{};
    for (size_t i = 0; i < alike.size(); ++i) {
      members[i] = &bodies[alike[i]];
      set.at[i] = at[alike[i]];
      set.number[i] = static_cast<int>(alike[i]);
    }
    set.body = side_by_side(members);
    model.quads.push_back(std::move(set));
  }
}

}  // namespace flexboom
