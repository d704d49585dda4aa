#include "dynamics/relative/constants.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <tuple>
#include <utility>

namespace flexboom::tree {
namespace {

using equations::Body;
using equations::TermOf;
using Members = std::array<const Body*, Quad::width>;

/// The number that `of` finds in each body.
template <class B, class F>
Quad number(const std::array<B, Quad::width>& bodies, F of) {
  Quad r;
  for (int i = 0; i < Quad::width; ++i) set_lane(r, i, of(*bodies[static_cast<size_t>(i)]));
  return r;
}

template <class B, class F>
Vec3<Quad> vector(const std::array<B, Quad::width>& bodies, F of) {
  return {number(bodies, [&](const auto& b) { return of(b).x; }),
          number(bodies, [&](const auto& b) { return of(b).y; }),
          number(bodies, [&](const auto& b) { return of(b).z; })};
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

/// Rows of the terms that any of the bodies has.
equations::Rows<Quad> rows(const Members& bodies, equations::Rows<double> Body::*member) {
  std::map<std::tuple<int, int, int>, Quad> values;
  for (int lane = 0; lane < Quad::width; ++lane) {
    const equations::Rows<double>& of_body = bodies[static_cast<size_t>(lane)]->*member;
    for (const equations::RowOf& row : of_body.rows)
      for (auto i = static_cast<size_t>(row.begin); i < static_cast<size_t>(row.end); ++i)
        set_lane(values[{row.k, of_body.l[i], row.component}], lane, of_body.value[i]);
  }
  std::vector<TermOf<Quad>> terms;
  terms.reserve(values.size());
  for (const auto& [key, value] : values)
    terms.push_back({std::get<0>(key), std::get<1>(key), std::get<2>(key), value});
  return equations::Rows<Quad>(std::move(terms));
}

equations::BodyOf<Quad> body_side_by_side(const Members& b) {
  const auto scalar = [&b](double Body::*member) { return number(b, [=](const Body& x) { return x.*member; }); };
  equations::BodyOf<Quad> r;
  r.n = b[0]->n;
  r.m = scalar(&Body::m);
  r.mc0 = vector(b, [](const Body& x) { return x.mc0; });
  r.J0 = symmetric(b, [](const Body& x) { return x.J0; });
  r.Ct = vectors(b, &Body::Ct);
  r.Cr0 = vectors(b, &Body::Cr0);
  r.Cr1 = rows(b, &Body::Cr1);
  r.Cr1_by_l = rows(b, &Body::Cr1_by_l);
  r.J1 = rows(b, &Body::J1);
  r.J2 = rows(b, &Body::J2);
  r.Ke = numbers(b, &Body::Ke);
  r.De = numbers(b, &Body::De);
  r.Me = numbers(b, &Body::Me);
  r.Me_inverse = numbers(b, &Body::Me_inverse);
  r.diagonal = std::ranges::all_of(b, [](const Body* x) { return x->diagonal; });
  r.Gt = vectors(b, &Body::Gt);
  r.Ctt = symmetric(b, [](const Body& x) { return x.Ctt; });
  r.cos_threshold = scalar(&Body::cos_threshold);
  r.sin_threshold = scalar(&Body::sin_threshold);
  r.stiffness = scalar(&Body::stiffness);
  r.preload = scalar(&Body::preload);
  r.damping = scalar(&Body::damping);
  r.stop_stiffness = scalar(&Body::stop_stiffness);
  return r;
}

/// What may stand side by side: nothing hangs on it, pushes it or drives it, and its places move with no shape.
std::vector<char> plain_leaves(const Model& model) {
  std::vector<char> plain(model.links.size(), 1);
  const auto exclude = [&plain](int link) {
    if (link >= 0) plain[static_cast<size_t>(link)] = 0;
  };
  for (size_t i = 0; i < plain.size(); ++i) {
    const Link& link = model.links[i];
    exclude(link.parent);
    const bool may = (link.kind == JointKind::hinge || link.kind == JointKind::fixed) && !link.prescribed &&
                     !link.law && !link.second_order && !link.hung_on_moving_place && !link.b.moves();
    if (!may) plain[i] = 0;
  }
  for (const PlacedOn& load : model.loads) exclude(load.link);
  for (const PlacedOn& wheel : model.wheels) exclude(wheel.link);
  for (const SpringModel& spring : model.springs) exclude(spring.a.link), exclude(spring.b.link);
  return plain;
}

Leaves leaves_of(const Model& model, const std::vector<size_t>& alike) {
  Leaves r;
  r.count = static_cast<int>(alike.size());
  r.kind = model.links[alike[0]].kind;
  r.parent = model.links[alike[0]].parent;
  std::array<const Link*, Quad::width> links{};
  Members bodies{};
  for (size_t i = 0; i < links.size(); ++i) {
    const size_t from = alike[std::min(i, alike.size() - 1)];
    r.link[i] = static_cast<int>(from);
    links[i] = &model.links[from];
    bodies[i] = &links[i]->body;
  }
  r.body = body_side_by_side(bodies);
  r.position = vector(links, [](const Link& x) { return x.a.position; });
  for (size_t i = 0; i < 3; ++i) r.axes.row[i] = vector(links, [i](const Link& x) { return x.a.axes.row[i]; });
  return r;
}

}  // namespace

void place_side_by_side(Model& model) {
  std::vector<char> waits = plain_leaves(model), placed(model.links.size(), 0);
  for (size_t first = 0; first < waits.size(); ++first) {
    const Link& link = model.links[first];
    std::vector<size_t> alike;
    for (size_t i = first; i < waits.size() && alike.size() < Quad::width; ++i) {
      const Link& other = model.links[i];
      if (waits[i] && other.parent == link.parent && other.kind == link.kind && other.body.n == link.body.n)
        alike.push_back(i);
    }
    if (alike.size() < 2 || alike.front() != first) continue;
    for (const size_t i : alike) waits[i] = 0, placed[i] = 1;
    model.leaves.push_back(leaves_of(model, alike));
  }
  model.singles.clear();
  for (size_t i = 0; i < placed.size(); ++i)
    if (!placed[i]) model.singles.push_back(i);
}

}  // namespace flexboom::tree
