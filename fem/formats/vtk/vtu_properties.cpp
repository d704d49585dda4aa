#include "fem/formats/vtk/vtu_properties.hpp"

#include "fem/formats/vtk/cells.hpp"
#include "fem/mesh/element.hpp"

#include <fmt/format.h>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <string_view>

namespace flexboom {
namespace {

/// A field of cells or points, one column each.
class Field {
 public:
  Field(const VtuArrays& arrays, const char* where, std::string_view name, long components, long count)
      : arrays_(arrays), array_(VtuArrays::find(arrays.piece().child(where), name)) {
    if (!array_) return;
    if (arrays.components(array_) != components) fail(fmt::format("must have {} components", components));
    values_ = arrays.reals(array_, components * count);
    components_ = static_cast<size_t>(components);
  }

  explicit operator bool() const { return static_cast<bool>(array_); }

  Eigen::Map<const Eigen::VectorXd> operator()(long column) const {
    return {values_.data() + static_cast<size_t>(column) * components_, static_cast<Eigen::Index>(components_)};
  }

  /// The one value of a column as a whole number from 0 on.
  long whole(long column, long highest) const {
    const double value = values_[static_cast<size_t>(column)];
    if (!(value >= 0 && value <= static_cast<double>(highest)))
      fail(fmt::format("value {} is {}; it must be 0 to {}", column, value, highest));
    return static_cast<long>(value);
  }

  [[noreturn]] void fail(const std::string& message) const { arrays_.fail(array_, message); }

 private:
  const VtuArrays& arrays_;
  pugi::xml_node array_;
  std::vector<double> values_;
  size_t components_ = 1;
};

SectionShape section_of_numbers(const Field& field, long cell) {
  const auto n = field(cell);
  if (n(0) == 0) return RoundBar{n(1)};
  if (n(0) == 1) return Tube{n(1), n(2)};
  if (n(0) == 2) return Rectangle{n(1), n(2)};
  if (n(0) == 3) return RectangularTube{n(1), n(2), n(3)};
  if (n(0) == 4) return GeneralSection{n(1), n(2), n(3), n(4), n(5), n(6)};
  field.fail(fmt::format("kind {} of the section of cell {}; it must be 0 to 4", n(0), cell));
}

struct PropertyFields {
  Field property, material, order, start, end, beam, line_mass;

  PropertyFields(const VtuArrays& arrays, long cells)
      : property(arrays, "CellData", vtk_field::property, 1, cells),
        material(arrays, "CellData", vtk_field::material, 3, cells),
        order(arrays, "CellData", vtk_field::order, 1, cells),
        start(arrays, "CellData", vtk_field::beam_start, 7, cells),
        end(arrays, "CellData", vtk_field::beam_end, 7, cells),
        beam(arrays, "CellData", vtk_field::beam, 6, cells),
        line_mass(arrays, "CellData", vtk_field::line_mass, 1, cells) {
    if (!material) property.fail(fmt::format("needs the field \"{}\" beside it", vtk_field::material));
    if (beam && (!start || !end || !order)) beam.fail("needs the fields of sections and order beside it");
  }
};

BeamProperty beam_property(const PropertyFields& fields, const ElementType& row, long cell, const Material& material) {
  constexpr std::array<const char*, 3> rules = {"cowper", "nu-squared", "value"};
  const auto options = fields.beam(cell);
  BeamProperty property;
  property.start = section_of_numbers(fields.start, cell);
  property.end = section_of_numbers(fields.end, cell);
  property.material = material;
  property.theory = row.name == "beam-timoshenko" ? BeamTheory::timoshenko : BeamTheory::euler_bernoulli;
  property.y_axis = options.head<3>();
  property.rotary_inertia = options(3) != 0;
  if (fields.line_mass) property.line_mass = fields.line_mass(cell)(0);
  if (!(property.line_mass >= 0)) fields.line_mass.fail(fmt::format("cell {} is {}", cell, property.line_mass));
  if (!(options(4) >= 0 && options(4) < 3))
    fields.beam.fail(fmt::format("cell {} has no shear rule {}", cell, options(4)));
  property.shear = {rules[static_cast<size_t>(options(4))], options(5)};
  return property;
}

// Name of the solid property of each cell.
std::vector<std::string> property_names(const VtuArrays& arrays, long cells) {
  std::vector<std::string> names(static_cast<size_t>(cells));
  for (const pugi::xml_node array : arrays.piece().child("CellData").children("DataArray")) {
    const std::string_view name = array.attribute("Name").value();
    if (!name.starts_with(vtk_field::named)) continue;
    const std::vector<long> values = arrays.integers(array, cells);
    for (size_t i = 0; i < values.size(); ++i) {
      if (values[i] != 0) names[i] = name.substr(vtk_field::named.size());
    }
  }
  return names;
}

// Places in ascending order for the numbers that are there.
std::map<long, int> compacted(std::vector<long> numbers) {
  std::ranges::sort(numbers);
  std::map<long, int> places;
  for (const long number : numbers) places.try_emplace(number, static_cast<int>(places.size()));
  return places;
}

std::vector<long> whole_values(const Field& field, const std::vector<long>& cells) {
  constexpr long highest = std::numeric_limits<int>::max();
  std::vector<long> result;
  result.reserve(cells.size());
  for (const long cell : cells) result.push_back(field.whole(cell, highest));
  return result;
}

void read_labels(const VtuArrays& arrays, const char* where, const std::vector<long>& columns, long count,
                 std::vector<long>& labels) {
  constexpr long highest = 1L << 53;
  const Field field(arrays, where, vtk_field::label, 1, count);
  if (!field) return;
  for (const long column : columns) labels.push_back(field.whole(column, highest));
}

}  // namespace

void read_vtu_properties(const VtuArrays& arrays, const std::vector<long>& cell_of, long cells, Mesh& mesh) {
  const PropertyFields fields(arrays, cells);
  const std::vector<std::string> names = property_names(arrays, cells);
  std::array<std::vector<long>, 2> cells_of;  // of solids, of beams
  std::array<std::vector<Element*>, 2> elements;
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const size_t kind = type_of(mesh.elements[e]).shape == Shape::line ? 1 : 0;
    cells_of[kind].push_back(cell_of[e]);
    elements[kind].push_back(&mesh.elements[e]);
    if (fields.order) mesh.elements[e].order = static_cast<int>(fields.order.whole(cell_of[e], 100));
  }
  for (const size_t kind : {0U, 1U}) {
    const std::vector<long> numbers = whole_values(fields.property, cells_of[kind]);
    const std::map<long, int> places = compacted(numbers);
    mesh.solid_properties.resize(kind == 0 ? places.size() : mesh.solid_properties.size());
    mesh.beam_properties.resize(kind == 1 ? places.size() : 0);
    for (size_t i = 0; i < numbers.size(); ++i) {
      const long cell = cells_of[kind][i];
      const auto place = static_cast<size_t>(places.at(numbers[i]));
      elements[kind][i]->property = static_cast<int>(place);
      const auto m = fields.material(cell);
      const Material material{m(0), m(1), m(2)};
      if (kind == 0) mesh.solid_properties[place] = {names[static_cast<size_t>(cell)], material};
      if (kind == 1) mesh.beam_properties[place] = beam_property(fields, type_of(*elements[kind][i]), cell, material);
    }
  }
}

void read_vtu_node_fields(const VtuArrays& arrays, const std::vector<long>& cell_of, long cells, Mesh& mesh) {
  const long count = mesh.nodes.cols();
  std::vector<long> nodes(static_cast<size_t>(count));
  for (long i = 0; i < count; ++i) nodes[static_cast<size_t>(i)] = i;
  read_labels(arrays, "PointData", nodes, count, mesh.node_labels);
  read_labels(arrays, "CellData", cell_of, cells, mesh.element_labels);
  const Field held(arrays, "PointData", vtk_field::support, 6, count);
  const Field body(arrays, "PointData", vtk_field::body, 10, count);
  for (int node = 0; node < count; ++node) {
    if (held && held(node).any()) {
      Support& support = mesh.supports.emplace_back();
      support.node = node;
      for (size_t i = 0; i < 6; ++i) support.components[i] = held(node)(static_cast<Eigen::Index>(i)) != 0;
    }
    if (body && body(node).any()) {
      const auto v = body(node);
      NodalBody& made = mesh.bodies.emplace_back();
      made.node = node;
      made.mass = v(0);
      made.inertia << v(1), v(4), v(5), v(4), v(2), v(6), v(5), v(6), v(3);
      made.offset = v.tail<3>();
    }
  }
}

}  // namespace flexboom
