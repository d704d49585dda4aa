#include "fem/base/check.hpp"
#include "fem/formats/common/node_orders.hpp"
#include "fem/formats/vtk/cells.hpp"
#include "fem/formats/vtk/vtk.hpp"
#include "fem/formats/vtk/vtu_arrays.hpp"
#include "fem/formats/vtk/vtu_properties.hpp"
#include "fem/mesh/element.hpp"
#include "fem/mesh/mesh_sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace flexboom {
namespace {

// Numbers of groups as other programs call the field: meshio after Gmsh, Medit and its own, VTK, FEniCS, ParaView's
// and OpenGeoSys' readers. The first that is there tells the properties.
constexpr std::array<std::string_view, 10> group_fields = {
    "gmsh:physical", "cell_tags", "medit:ref",  "CellEntityIds", "MaterialIDs",
    "MaterialID",    "material",  "PhysicalId", "PhysicalIds",   "RegionId",
};

/// What a cell became.
struct CellUse {
  int element = -1;  // -1: carries sets only
  size_t begin = 0;  // its points
  size_t end = 0;
};

class VtuReader {
 public:
  VtuReader(std::string_view text, const std::string& file) : arrays_(text, file) {}

  MeshFile read();

 private:
  void points();
  void cells();
  void cell(size_t i, int type);
  void rows();
  void point_fields();
  void cell_sets();
  void add_cell_set(const std::string& name, const std::vector<long>& cells);
  void properties();
  pugi::xml_node needed(pugi::xml_node parent, const char* name);
  std::vector<long> members(pugi::xml_node array, long count) const;
  int type_of_row(pugi::xml_node array, std::string_view row) const;

  VtuArrays arrays_;
  MeshFile file_;
  std::vector<long> connectivity_, types_;
  std::vector<CellUse> uses_;
  std::vector<long> cell_of_;  // of each element
  VtkSolid solid_;             // of the cell read last
};

MeshFile VtuReader::read() {
  points();
  cells();
  rows();
  properties();
  cell_sets();
  point_fields();
  Mesh& mesh = file_.mesh;
  for (auto* sets : {&mesh.node_sets, &mesh.element_sets}) {
    for (auto& [name, members] : *sets) members = sorted_unique(std::move(members));
  }
  turn_wedges(mesh);  // some programs write linear wedges as vtkQuadraticWedge numbers them
  drop_unused_nodes(mesh, file_.notes);
  mesh.nodes = lobatto_from_equispaced(mesh, mesh.nodes);
  return std::move(file_);
}

pugi::xml_node VtuReader::needed(pugi::xml_node parent, const char* name) {
  const pugi::xml_node array = VtuArrays::find(parent, name);
  if (!array)
    arrays_.fail(parent ? parent : arrays_.piece(), fmt::format("there is no DataArray \"{}\" of cells", name));
  return array;
}

void VtuReader::points() {
  const long count = arrays_.count("NumberOfPoints");
  const pugi::xml_node array = arrays_.piece().child("Points").child("DataArray");
  if (!array) arrays_.fail(arrays_.piece(), "there is no DataArray in Points");
  if (arrays_.components(array) != 3) arrays_.fail(array, "points must have 3 components");
  const std::vector<double> values = arrays_.reals(array, 3 * count);
  file_.mesh.nodes = Eigen::Map<const Eigen::Matrix3Xd>(values.data(), 3, count);
}

void VtuReader::cells() {
  const long count = arrays_.count("NumberOfCells");
  const pugi::xml_node cells = arrays_.piece().child("Cells");
  const pugi::xml_node offsets_array = needed(cells, "offsets"), points_array = needed(cells, "connectivity");
  const std::vector<long> offsets = arrays_.integers(offsets_array, count);
  types_ = arrays_.integers(needed(cells, "types"), count);
  long last = 0;
  for (size_t i = 0; i < offsets.size(); ++i) {
    if (offsets[i] < last) arrays_.fail(offsets_array, fmt::format("offset {} of cell {} goes back", offsets[i], i));
    if (offsets[i] > 1L << 40)
      arrays_.fail(offsets_array, fmt::format("offset {} of cell {} is too large", offsets[i], i));
    uses_.push_back({-1, static_cast<size_t>(last), static_cast<size_t>(offsets[i])});
    last = offsets[i];
  }
  connectivity_ = arrays_.integers(points_array, last);
  for (size_t i = 0; i < connectivity_.size(); ++i) {
    if (connectivity_[i] >= 0 && connectivity_[i] < file_.mesh.nodes.cols()) continue;
    const auto owner = std::ranges::upper_bound(uses_, i, {}, &CellUse::end);
    arrays_.fail(points_array, fmt::format("cell {}: point {} is missing; there are points 0 to {}",
                                           owner - uses_.begin(), connectivity_[i], file_.mesh.nodes.cols() - 1));
  }
  for (size_t i = 0; i < uses_.size(); ++i) cell(i, static_cast<int>(std::clamp(types_[i], -1L, 1000L)));
  if (file_.mesh.elements.empty()) {
    arrays_.fail(cells, fmt::format("there are no volume cells among {}; mesh the volume, and save the mesh, not its "
                                    "surface",
                                    count));
  }
}

void VtuReader::cell(size_t i, int type) {
  CellUse& use = uses_[i];
  const size_t points = use.end - use.begin;
  const bool is_beam = type == 3 && VtuArrays::find(arrays_.piece().child("CellData"), vtk_field::beam);
  const bool alike = solid_.type == type && solid_.node_order.size() == points;
  if (!alike) solid_ = vtk_solid(type, points, arrays_.before_2_1());
  if (is_beam && points == 2) solid_ = {type, "beam-timoshenko", 1, {}};
  if (solid_.type == 0) {
    if (is_vtk_carrier(type)) return;
    arrays_.fail(
        arrays_.piece().child("Cells"),
        fmt::format("cell {} of type {} with {} points is no element; there are tetrahedra (10, 24), hexahedra "
                    "(12, 25, 29, 72) and wedges (13, 26)",
                    i, types_[i], points));
  }
  use.element = static_cast<int>(file_.mesh.elements.size());
  cell_of_.push_back(static_cast<long>(i));
  Element& element = file_.mesh.elements.emplace_back();
  element.type = element_type(solid_.row);
  element.order = solid_.order;
  element.nodes.resize(points);
  for (size_t k = 0; k < points; ++k) {
    const size_t place = solid_.node_order.empty() ? k : static_cast<size_t>(solid_.node_order[k]);
    element.nodes[place] = static_cast<int>(connectivity_[use.begin + k]);
  }
}

// Indices where a field is not 0.
std::vector<long> VtuReader::members(pugi::xml_node array, long count) const {
  const std::vector<long> values = arrays_.integers(array, count * arrays_.components(array));
  std::vector<long> result;
  for (size_t i = 0; i < values.size(); ++i) {
    if (values[i] != 0) result.push_back(static_cast<long>(i));
  }
  if (arrays_.components(array) != 1) arrays_.fail(array, "a set must have one component");
  return result;
}

int VtuReader::type_of_row(pugi::xml_node array, std::string_view row) const {
  try {
    return element_type(row);
  } catch (const InputError& error) {
    arrays_.fail(array, error.what());
  }
}

// Cells that are another row than their type says: its nodes are put from the order of the one into that of the other.
void VtuReader::rows() {
  for (const pugi::xml_node array : arrays_.piece().child("CellData").children("DataArray")) {
    const std::string_view name = array.attribute("Name").value();
    if (!name.starts_with(vtk_field::row)) continue;
    const std::string_view row = name.substr(vtk_field::row.size());
    for (const long cell : members(array, std::ssize(uses_))) {
      const CellUse& use = uses_[static_cast<size_t>(cell)];
      const long type = types_[static_cast<size_t>(cell)];
      const bool fits = type == 3 ? row.starts_with("beam-") : may_be_row(static_cast<int>(type), row);
      if (use.element < 0 || !fits)
        arrays_.fail(array, fmt::format("cell {} of type {} cannot be {}", cell, type, row));
      Element& element = file_.mesh.elements[static_cast<size_t>(use.element)];
      element.type = type_of_row(array, row);
      if (row != "hex") continue;
      element.order = type == 12 ? 1 : 2;
      const std::vector<int> order = vtk_hexahedron_order(element.order, false);
      const std::vector<int> nodes = element.nodes;
      for (size_t k = 0; k < nodes.size(); ++k) element.nodes[static_cast<size_t>(order[k])] = nodes[k];
    }
  }
}

void VtuReader::add_cell_set(const std::string& name, const std::vector<long>& cells) {
  std::vector<int> elements, nodes;
  for (const long cell : cells) {
    const CellUse& use = uses_[static_cast<size_t>(cell)];
    if (use.element >= 0) elements.push_back(use.element);
    if (use.element >= 0) continue;
    for (size_t k = use.begin; k < use.end; ++k) nodes.push_back(static_cast<int>(connectivity_[k]));
  }
  const auto add = [&name](auto& sets, const std::vector<int>& some) {
    if (some.empty()) return;
    std::vector<int>& set = sets[name];
    set.insert(set.end(), some.begin(), some.end());
  };
  add(file_.mesh.element_sets, elements);
  add(file_.mesh.node_sets, nodes);
}

void VtuReader::cell_sets() {
  const pugi::xml_node data = arrays_.piece().child("CellData");
  const long count = std::ssize(uses_);
  for (const pugi::xml_node array : data.children("DataArray")) {
    const std::string_view name = array.attribute("Name").value();
    if (name.starts_with(vtk_field::set))
      add_cell_set(std::string(name.substr(vtk_field::set.size())), members(array, count));
  }
  for (const std::string_view name : group_fields) {
    const pugi::xml_node array = VtuArrays::find(data, name);
    if (!array || !VtuArrays::has_integers(array) || arrays_.components(array) != 1) continue;
    std::map<long, std::vector<long>> groups;
    const std::vector<long> values = arrays_.integers(array, count);
    for (size_t i = 0; i < values.size(); ++i) groups[values[i]].push_back(static_cast<long>(i));
    if (name == "gmsh:physical") groups.erase(0);  // of no group
    for (const auto& [number, cells] : groups) add_cell_set(fmt::format("{}", number), cells);
  }
}

void VtuReader::properties() {
  Mesh& mesh = file_.mesh;
  const pugi::xml_node data = arrays_.piece().child("CellData");
  if (VtuArrays::find(data, vtk_field::property))
    return read_vtu_properties(arrays_, cell_of_, std::ssize(uses_), mesh);
  std::vector<long> groups(uses_.size(), 0);
  bool has_groups = false;
  for (const std::string_view name : group_fields) {
    const pugi::xml_node array = VtuArrays::find(data, name);
    if (has_groups || !array || !VtuArrays::has_integers(array) || arrays_.components(array) != 1) continue;
    groups = arrays_.integers(array, std::ssize(uses_));
    has_groups = true;
  }
  std::map<long, int> indices;
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const long group = groups[static_cast<size_t>(cell_of_[e])];
    const auto [found, is_new] = indices.try_emplace(group, static_cast<int>(mesh.solid_properties.size()));
    if (is_new) mesh.solid_properties.push_back({has_groups ? fmt::format("{}", group) : "solid", {}});
    mesh.elements[e].property = found->second;
  }
}

void VtuReader::point_fields() {
  Mesh& mesh = file_.mesh;
  const long count = mesh.nodes.cols();
  for (const pugi::xml_node array : arrays_.piece().child("PointData").children("DataArray")) {
    const std::string_view name = array.attribute("Name").value();
    if (!name.starts_with(vtk_field::set)) continue;
    std::vector<int>& set = mesh.node_sets[std::string(name.substr(vtk_field::set.size()))];
    for (const long node : members(array, count)) set.push_back(static_cast<int>(node));
  }
  read_vtu_node_fields(arrays_, cell_of_, std::ssize(uses_), mesh);
}

}  // namespace

MeshFile read_vtu(std::string_view text, const std::string& file) { return VtuReader(text, file).read(); }

}  // namespace flexboom
