#include "apps/model/static_shapes.hpp"

#include "fem/base/text_reader.hpp"

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

std::vector<std::string> static_shapes_at(const std::string& node_set) {
  std::vector<std::string> shapes;
  for (const char* direction : {"Fx", "Fy", "Fz", "Mx", "My", "Mz"}) shapes.push_back(node_set + "." + direction);
  return shapes;
}

std::vector<std::string> static_shapes_of_loads(const Scene& scene, const BodyScene& body) {
  std::vector<std::string> sets, shapes;
  const auto note = [&](const PlaceScene& place) {
    const bool is_held = place.marker == body.clamp && body.basis.name != "mean-axis";
    if (place.body != body.name || place.marker.empty() || is_held) return;
    if (std::ranges::find(sets, place.marker) == sets.end()) sets.push_back(place.marker);
  };
  for (const JointScene& joint : scene.joints) note(joint.a), note(joint.b);
  for (const HingeScene& hinge : scene.hinges) note({.body = hinge.body, .marker = "root"});
  for (const SpringScene& spring : scene.springs) note(spring.a), note(spring.b);
  for (const LoadScene& load : scene.loads) note(load.at);
  for (const std::string& set : sets)
    for (std::string& shape : static_shapes_at(set)) shapes.push_back(std::move(shape));
  return shapes;
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
