// Any bytes must be a mesh or an InputError. One program per reader: FLEXBOOM_FUZZ_READER is its name.

#include "fem/base/check.hpp"
#include "fem/formats/abaqus/read.hpp"
#include "fem/formats/gmsh/gmsh.hpp"
#include "fem/formats/nastran/read.hpp"
#include "fem/formats/vtk/vtk.hpp"

#include <cstddef>
#include <cstdint>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    flexboom::MeshFile file = flexboom::FLEXBOOM_FUZZ_READER(text, "fuzz");
    for (flexboom::SolidProperty& property : file.mesh.solid_properties) property.material = {1e9, 0.3, 1000};
    file.mesh.validate();                  // finds an index that leads nowhere
  } catch (const flexboom::InputError&) {  // as it should be
  }
  return 0;
}
