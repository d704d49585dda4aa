#include "apps/model/static_shapes.hpp"

#include "apps/base/deflection.hpp"
#include "apps/scene/wanted_accuracy.hpp"
#include "fem/base/text_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace flexboom {

std::vector<std::string> static_shapes_beside(const ReducedBody& body, const std::string& clamped) {
  const auto has = [&](const char* kind) {
    return std::ranges::find(body.coordinates, kind, &Coordinate::kind) != body.coordinates.end();
  };
  const std::string end = clamped == "tip" ? "root" : "tip";
  std::vector<std::string> shapes;
  if (!has("axial")) shapes.push_back(end + ".Fx");
  if (!has("torsion")) shapes.push_back(end + ".Mx");
  return shapes;
}

std::vector<int> first_and_stretching(const ReducedBody& body, int first, const ReducedBody& kept) {
  constexpr int few = 2;  // beyond those of the model: the next alone may happen to do little
  std::vector<int> list;
  for (int k = 1; k <= first; ++k) list.push_back(k);
  for (const char* kind : {"axial", "torsion"}) {
    const auto is_of_kind = [kind](const Coordinate& c) { return c.kind == kind; };
    const auto own = std::ranges::count_if(kept.coordinates, is_of_kind);
    auto count = std::count_if(body.coordinates.begin(), body.coordinates.begin() + first, is_of_kind);
    for (int k = first; k < body.n() && count < own + few; ++k)
      if (is_of_kind(body.coordinates[static_cast<size_t>(k)])) list.push_back(k + 1), ++count;
    if (count <= own) return {};
  }
  std::ranges::sort(list);
  return list;
}

std::vector<std::string> static_shapes_at(const std::string& node_set) {
  std::vector<std::string> shapes;
  for (const char* direction : {"Fx", "Fy", "Fz", "Mx", "My", "Mz"}) shapes.push_back(node_set + "." + direction);
  return shapes;
}

std::vector<std::string> static_shapes_at(const std::vector<std::string>& node_sets) {
  std::vector<std::string> shapes;
  for (const std::string& set : node_sets)
    for (std::string& shape : static_shapes_at(set)) shapes.push_back(std::move(shape));
  return shapes;
}

bool is_interface(const BodyScene& body, const std::string& marker) {
  return body.basis.name == "craig-bampton" && std::ranges::any_of(body.basis.interfaces, [&](const std::string& text) {
           return same_but_case(text.substr(0, text.find(':')), marker);
         });
}

namespace {

/// Where joints, springs and loads of a scene act on a body, by its markers.
std::vector<std::string> loaded_markers(const Scene& scene, const std::string& body) {
  std::vector<std::string> markers;
  const auto note = [&](const PlaceScene& place) {
    if (place.body != body || place.marker.empty()) return;
    if (std::ranges::find(markers, place.marker) == markers.end()) markers.push_back(place.marker);
  };
  for (const JointScene& joint : scene.joints) note(joint.a), note(joint.b);
  for (const HingeScene& hinge : scene.hinges) note({.body = hinge.body, .marker = "root"});
  for (const SpringScene& spring : scene.springs) note(spring.a), note(spring.b);
  for (const LoadScene& load : scene.loads) note(load.at);
  return markers;
}

}  // namespace

std::vector<std::string> static_shapes_of_loads(const Scene& scene, const BodyScene& body) {
  std::vector<std::string> markers = loaded_markers(scene, body.name);
  std::erase_if(markers, [&](const std::string& marker) {
    const bool is_held = marker == body.clamp && body.basis.name != "mean-axis";
    return is_held || is_interface(body, marker);
  });
  return static_shapes_at(markers);
}

bool can_load(const ReducedBody& body, const std::string& name) {
  const bool is_interface = std::ranges::find(body.interfaces, name, &Interface::name) != body.interfaces.end();
  const auto marker = std::ranges::find(body.markers, name, &Marker::name);
  return !is_interface && marker != body.markers.end() && marker->S.norm() + marker->S_theta.norm() > 0;
}

namespace {

/// Is a place the node of that other one? A load on it is one on both.
bool is_same_node(const ReducedBody& body, const std::string& name, const std::string& other) {
  const Marker &a = marker(body, name), &b = marker(body, other);
  return a.position == b.position && a.S == b.S && a.S_theta == b.S_theta;
}

}  // namespace

std::vector<std::string> loads_without_shapes(const Scene& scene, const BodyScene& body) {
  if (!body.reduced || !body.richer || !body.richer->more_modes) return {};
  std::vector<std::string> markers = loaded_markers(scene, body.name);
  const ReducedBody& richer = *body.richer->more_modes;
  std::erase_if(markers, [&](const std::string& loaded) {
    return !can_load(*body.reduced, loaded) || std::ranges::any_of(richer.coordinates, [&](const Coordinate& c) {
      return c.kind == "attachment" && is_same_node(richer, loaded, c.interface);
    });
  });
  return markers;
}

std::string loads_without_stiffness(const Scene& scene, const ReducedBody& body) {
  if (body.n() == 0 || body.Kg.spin.empty()) return {};
  std::vector<std::string> markers = loaded_markers(scene, body.name);
  const bool has_tip = scene.outputs.empty() || names_output(scene.outputs, body.name + ".tip");
  if (const Marker* tip = tip_of(body); has_tip && tip != nullptr) markers.push_back(tip->name);
  std::ranges::sort(markers);
  markers.erase(std::unique(markers.begin(), markers.end()), markers.end());
  std::erase_if(markers, [&](const std::string& loaded) {
    const Marker& place = marker(body, loaded);
    return place.S.norm() + place.S_theta.norm() == 0 ||
           std::ranges::any_of(body.Kg.markers,
                               [&](const MarkerStiffness& k) { return is_same_node(body, loaded, k.marker); });
  });
  if (markers.empty()) return "";
  return fmt::format("body {} has no geometric stiffness of loads at {} (reduce --loads-at names its markers)",
                     body.name, fmt::join(markers, ", "));
}

void add_static_shapes(std::vector<std::string>& corrections, const std::vector<std::string>& shapes) {
  for (const std::string& shape : shapes)
    if (std::ranges::none_of(corrections, [&](const std::string& c) { return same_but_case(c, shape); }))
      corrections.push_back(shape);
}

BodyScene with_static_shapes(const BodyScene& body, const std::vector<std::string>& shapes) {
  BodyScene more = body;
  if (body.structure == "beam" || body.structure == "solid") add_static_shapes(more.basis.corrections, shapes);
  return more;
}

}  // namespace flexboom
