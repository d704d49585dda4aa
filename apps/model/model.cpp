#include "apps/model/model.hpp"

#include "apps/base/usage.hpp"
#include "apps/model/prepared_body.hpp"
#include "fem/base/check.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/formats/mesh_formats.hpp"

#include <fmt/format.h>

namespace flexboom {
namespace {

void hold(Model& model) {
  if (!model.clamped.empty()) model.clamp = node_set(model.mesh, model.clamped);
}

Model body_model(const std::filesystem::path& path, const ModelOptions& options) {
  BodyScene body = read_body(path);
  require(!options.read.dialect, fmt::format("--dialect: is for decks (.inp); {} is a body file", path.string()));
  if (options.structure) body.structure = *options.structure;
  const bool solid = body.structure == "solid";
  require(solid || body.structure == "beam" || body.structure == "eq14" || body.structure == "rigid",
          fmt::format(R"(--structure: "{}" is unknown; there are "beam" and "solid")", body.structure));
  require(solid || !options.element, "--element: is for solids; add --structure solid");
  require(solid || !options.accuracy, "--accuracy: is for solids; add --structure solid");
  if (options.order) (solid ? body.solid.order : body.geometry.order) = *options.order;
  if (options.element) body.solid.element = *options.element;
  if (options.accuracy) body.solid.accuracy = *options.accuracy;
  if (options.clamp) body.clamp = *options.clamp;
  if (options.material) {
    for (BeamSegment& s : body.geometry.segments) s.material = parse_material(*options.material);
  }
  Model model;
  model.name = body.name;
  model.mesh = mesh_of(body);
  if (body.modes_given && !body.modes_auto && body.modes > 0) model.modes = body.modes;
  model.backend = body.backend;
  model.damping = body.damping;
  model.basis = body.basis;
  if (body.structure == "eq14")
    model.notes.emplace_back(
        "modes solves finite elements; the closed form of structure = \"eq14\" is in `flexboom compare`");
  if (!options.free) model.clamped = body.clamp;
  model.body = std::move(body);
  hold(model);
  return model;
}

Model file_model(const std::filesystem::path& path, const ModelOptions& options) {
  for (const auto& [given, name] : {std::pair{options.structure.has_value(), "--structure"},
                                    {options.element.has_value(), "--element"},
                                    {options.order.has_value(), "--order"},
                                    {options.accuracy.has_value(), "--accuracy"}}) {
    require(!given, fmt::format("{}: is for body files (.toml); {} has its elements", name, path.string()));
  }
  ReadOptions read = options.read;
  if (options.material) read.material = parse_material(*options.material);
  MeshFile file = read_mesh(path, read);
  Model model;
  model.name = path.stem().string();
  model.mesh = std::move(file.mesh);
  model.modes = file.modes;
  model.notes = std::move(file.notes);
  if (options.clamp) model.clamp.nodes = node_set(model.mesh, *options.clamp);
  model.clamp.with_supports = !options.free;
  return model;
}

}  // namespace

Material parse_material(const std::string& text) {
  const std::optional<std::vector<double>> values = to_reals(text);
  require_usage(values && values->size() == 3,
                fmt::format("--material: '{}' is not E,nu,rho, e.g. 67e9,0.33,2840", text));
  const Material m{(*values)[0], (*values)[1], (*values)[2]};
  m.validate();
  return m;
}

Model refined(const Model& model, int steps) {
  require(model.body.has_value(), fmt::format("{}: a mesh file has no finer mesh", model.name));
  Model r = model;
  r.mesh = mesh_of(*model.body, model.body->structure == "beam" ? 2 * steps : steps);
  hold(r);
  return r;
}

std::optional<Model> refined_if_bearable(const Model& model, int steps) {
  Model r = refined(model, steps);
  if (!is_bearable(r.mesh)) return {};
  return r;
}

Model load_model(const std::filesystem::path& path, const ModelOptions& options) {
  Model model = path.extension() == ".toml" ? body_model(path, options) : file_model(path, options);
  if (model.body)
    for (std::string& doubt : doubts_of_beams(*model.body)) model.notes.push_back(std::move(doubt));
  for (std::string& suspicion : suspicions(model.mesh)) model.notes.push_back(std::move(suspicion));
  return model;
}

}  // namespace flexboom
