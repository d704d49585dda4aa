#include "apps/base/usage.hpp"
#include "apps/commands/commands.hpp"
#include "fem/formats/mesh_formats.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace flexboom {

using nlohmann::ordered_json;

int mesh_command(const MeshArguments& a, const CommonOptions& common) {
  require_not_replaced(a.body, a.file);
  Model model = load_model(a.body, a.options);
  write_mesh(a.file, model.mesh);
  if (!model.clamped.empty())
    model.notes.push_back(
        fmt::format("the file does not say that \"{0}\" is held; its modes take --clamp {0}", model.clamped));
  const Mesh& mesh = model.mesh;
  if (a.file.extension() == ".msh" && !mesh.beam_properties.empty())
    model.notes.emplace_back(
        "a .msh file holds no sections of beams, so its beams cannot be read again; .inp and .vtu do");
  if (common.json) {
    ordered_json sets;
    for (const auto& [name, nodes] : mesh.node_sets) sets["node_sets"][name] = nodes.size();
    for (const auto& [name, elements] : mesh.element_sets) sets["element_sets"][name] = elements.size();
    const ordered_json j = {{"file", a.file.string()},
                            {"nodes", mesh.nodes.cols()},
                            {"elements", mesh.elements.size()},
                            {"sets", sets},
                            {"notes", model.notes}};
    fmt::print("{}\n", j.dump(2));
  } else if (!common.quiet) {
    for (const std::string& note : model.notes) print_note("note: " + note);
    fmt::print("{}: {} nodes, {} elements\n", a.file.string(), mesh.nodes.cols(), mesh.elements.size());
  }
  return exit_ok;
}

}  // namespace flexboom
