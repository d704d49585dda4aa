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

void write_solid(Writer& out, const SolidOptions& solid) {
  out.table("[bodies.solid]");
  out.key("element", solid.element);
  out.key("accuracy", solid.accuracy);
  out.key("order", solid.order);
  out.key("slit", solid.slit, "m");
  const SolidGrading& g = solid.grading;
  out.table("[bodies.solid.grading]");
  out.key("sectors", g.sectors);
  out.key("rings", g.rings);
  out.key("long_elements", g.long_elements);
  out.key("end_layers", g.end_layers);
  out.key("first_layer", g.first_layer);
  out.key("growth", g.growth);
  out.key("corner_levels", g.corner_levels);
  out.key("factor", g.factor);
}

void write_body(Writer& out, const BodyScene& body) {
  const BeamGeometry& boom = body.geometry;
  out.table("[[bodies]]");
  out.key("name", body.name);
  if (body.rigid) {
    out.key("mass", body.rigid->mass, "kg");
    out.key("inertia", body.rigid->inertia, "kg m^2, about its mass centre");
    out.key("centre", body.rigid->centre, "m");
    out.key("size", body.rigid->size, "m");
    return;
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
  write_solid(out, body.solid);
  for (const BeamSegment& segment : boom.segments) write_segment(out, segment);
  for (const RigidAttachment& attachment : boom.attachments) write_attachment(out, attachment);
}

void write_hinge(Writer& out, const HingeScene& scene) {
  const Hinge& hinge = scene.hinge;
  const HingeMechanism& mechanism = hinge.mechanism;
  out.table("[[hinges]]");
  out.key("body", scene.body);
  out.key("point", hinge.point, "m, hub axes");
  out.key("stowed", hinge.stowed);
  out.key("outward", hinge.outward);
  out.key("stiffness", mechanism.stiffness, "N m/rad, P1 / threshold");
  out.key("rest", mechanism.rest, "rad");
  out.key("P2", mechanism.damping, "N m s/rad");
  out.key("P3", mechanism.stop_stiffness, "N m/rad");
  out.key("threshold", mechanism.threshold, "rad");
  out.key("start_angle", scene.start_angle, "rad");
  out.key("start_rate", scene.start_rate, "rad/s");
  out.key("loads", scene.loads);
}

void write_orbit(Writer& out, const OrbitScene& orbit) {
  out.table("[orbit]");
  out.key("altitude", orbit.altitude, "m, of the perigee");
  out.key("eccentricity", orbit.eccentricity);
  out.key("inclination", orbit.inclination, "rad");
  out.key("node", orbit.node, "rad");
  out.key("perigee", orbit.perigee, "rad");
  out.key("anomaly", orbit.anomaly, "rad");
  out.key("gravity", orbit.gravity);
  out.key("J2", orbit.J2);
}

void write_settings(Writer& out, const Scene& scene) {
  out.key("format", scene_keys::scene_format);
  out.key("name", scene.name);
  out.key("duration", scene.duration, "s");
  out.key("output_step", scene.output_step, "s");
  out.key("vtu_step", scene.vtu_step, "s; 0: no VTU files");
  if (scene.is_tree) out.key("gravity", scene.gravity, "m/s^2");
  out.table("[accuracy]");
  out.key("tolerance", scene.tolerance);
  out.key("outputs", scene.outputs, scene.outputs.empty() ? "all" : "");
  out.key("budget", scene.error_budget);
  out.table("[integrator]");
  out.key("method", scene.integrator);
  out.key("formulation", scene.formulation);
  out.key("settle", scene.settle);
  out.key("rescale_at_events", scene.rescale_at_events);
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
  if (scene.orbit) write_orbit(out, *scene.orbit);
  if (scene.is_tree) {
    for (const BodyScene& body : scene.bodies) write_body(out, body);
    write_tree(out, scene);
    return std::move(out).text();
  }
  out.table("[hub]");
  out.key("mass", scene.hub.mass, "kg");
  out.key("inertia", scene.hub.inertia, "kg m^2");
  out.key("fixed", scene.hub.fixed);
  out.key("size", scene.hub.size, "m");
  out.table("[initial]");
  out.key("rate", scene.start_rate, "rad/s");
  out.key("velocity", scene.start_velocity, "m/s");
  for (const BodyScene& body : scene.bodies) write_body(out, body);
  for (const HingeScene& hinge : scene.hinges) write_hinge(out, hinge);
  return std::move(out).text();
}

}  // namespace flexboom
