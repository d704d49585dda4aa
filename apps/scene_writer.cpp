#include "apps/keys.hpp"
#include "apps/scene.hpp"
#include "apps/scene_keys.hpp"
#include "apps/toml_writer.hpp"

#include <fmt/format.h>

namespace flexboom {
namespace {

using scene_keys::Dimension;
using toml_writer::toml;
using toml_writer::Writer;

std::string inline_dimensions(SectionShape shape) {
  std::string text;
  for (const Dimension& d : scene_keys::dimensions(shape)) {
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", d.key, toml(*d.value));
  }
  return "{ " + text + " }";
}

void write_segment(Writer& out, BeamSegment segment) {
  out.table("[[bodies.segments]]");
  out.key("shape", scene_keys::shapes[segment.start.index()]);
  for (const Dimension& d : scene_keys::dimensions(segment.start)) out.key(d.key, *d.value);
  out.raw("end", inline_dimensions(segment.end));
  out.key("length", segment.length, "m");
  out.key("elements", segment.elements, segment.elements == 0 ? "chosen by the program" : "");
  const Material& material = segment.material;
  out.raw("material",
          fmt::format("{{ E = {}, nu = {}, rho = {} }}", toml(material.E), toml(material.nu), toml(material.rho)));
}

void write_attachment(Writer& out, const RigidAttachment& attachment) {
  out.table("[[bodies.attachments]]");
  out.key("name", attachment.name);
  out.key("position", attachment.position, "m from the root");
  out.key("mass", attachment.mass, "kg");
  out.key("inertia", attachment.inertia, "kg m^2, about its mass centre");
  out.key("offset", attachment.offset, "m");
}

std::string inline_damping(const DampingRule& damping) {
  return fmt::format("{{ rule = {}, value = {}, alpha = {}, beta = {} }}", toml(damping.name), toml(damping.value),
                     toml(damping.alpha), toml(damping.beta));
}

void write_body(Writer& out, const BodyScene& body) {
  const BeamGeometry& boom = body.geometry;
  out.table("[[bodies]]");
  out.key("name", body.name);
  if (body.rigid) {
    return write_keys(out, "", *body.rigid, rigid_keys);
  }
  if (!body.stiffening.empty()) out.key("stiffening", body.stiffening);
  if (body.reduced) {
    out.key("file", body.reduced_file.string());
    out.raw("damping", inline_damping(body.damping));
    return;
  }
  out.key("structure", body.structure);
  out.key("clamp", body.clamp);
  out.raw("modes", body.modes_auto ? "\"auto\"" : toml(body.modes));
  out.key("directions", body.directions);
  const BasisOptions& basis = body.basis;
  out.key("basis", basis.name);
  if (basis.name == "craig-bampton") {
    out.key("interfaces", basis.interfaces);
    out.key("reference", basis.reference);
    out.key("orthonormal", basis.orthonormal);
  }
  if (basis.name == "hinge") {
    out.key("hinge_stiffness", basis.hinge_stiffness, "N m/rad");
    out.key("hinge_axis", basis.hinge_axis);
  }
  out.key("corrections", basis.corrections);
  out.key("theory", scene_keys::theories[static_cast<size_t>(boom.theory)]);
  out.raw("shear", boom.shear.name == "value" ? toml(boom.shear.value) : toml(boom.shear.name));
  out.key("rotary_inertia", boom.rotary_inertia);
  out.key("order", boom.order);
  out.key("backend", body.backend);
  out.raw("damping", inline_damping(body.damping));
  write_keys(out, "[bodies.solid]", body.solid, solid_keys);
  write_keys(out, "[bodies.solid.grading]", body.solid.grading, grading_keys);
  for (const BeamSegment& segment : boom.segments) write_segment(out, segment);
  for (const RigidAttachment& attachment : boom.attachments) write_attachment(out, attachment);
}

void write_settings(Writer& out, const Scene& scene) {
  out.key("format", scene_keys::scene_format);
  write_keys(out, "", scene, settings_keys);
  if (scene.is_tree) out.key("gravity", scene.gravity, "m/s^2");
  write_keys(out, "[accuracy]", scene, accuracy_keys);
  write_keys(out, "[integrator]", scene, integrator_keys);
}

}  // namespace

std::string to_toml(const BodyScene& body) {
  Writer out;
  write_body(out, body);
  return std::move(out).text();
}

std::string to_toml(const Scene& scene) {
  Writer out;
  write_settings(out, scene);
  if (scene.orbit) write_keys(out, "[orbit]", *scene.orbit, orbit_keys);
  if (scene.is_tree) {
    for (const BodyScene& body : scene.bodies) write_body(out, body);
    write_tree(out, scene);
    return std::move(out).text();
  }
  write_keys(out, "[hub]", scene.hub, hub_keys);
  write_keys(out, "[initial]", scene, initial_keys);
  for (const BodyScene& body : scene.bodies) write_body(out, body);
  for (const HingeScene& hinge : scene.hinges) write_keys(out, "[[hinges]]", hinge, hinge_keys);
  return std::move(out).text();
}

}  // namespace flexboom
