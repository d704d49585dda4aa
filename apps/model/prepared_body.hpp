#pragma once

#include "apps/scene/scene.hpp"
#include "reduction/body/reduced_body.hpp"

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace flexboom {

/// A body of a scene made ready to fly, with what is known of its quality.
struct PreparedBody {
  ReducedBody body;
  int elements = 0;                // 0 where it was read from a file or is in closed form
  int dofs = 0;                    // unknowns of the model, 0 in closed form
  int modes = 0;                   // as BodyScene::modes; other bases have other numbers of coordinates
  std::vector<int> shapes;         // as BodyScene::shapes
  std::vector<BodyCheck> checks;   // empty in closed form
  std::vector<std::string> notes;  // what the basis has to say
  std::filesystem::path kept;      // the file that later runs read it from; empty: none

  /// Coordinates but the static shapes of unit loads, which are the last.
  int coordinates_of_modes() const;
};

/// The order raised by so many steps, or where that is too high, elements half as long.
BeamGeometry refined(BeamGeometry, int steps);

/// Elements of a boom. `refine` raises their order, or where that is the highest makes them smaller; of solids it also
/// refines singular rims. @throws InputError where there is no mesh that is so coarse.
Mesh mesh_of(const BodyScene&, int refine = 0);

/// Has a mesh 140 000 unknowns at most? More take minutes, and more than four gigabytes.
bool is_bearable(const Mesh&);

/// Geometry -> mesh -> K, M -> basis -> reduced body, or the closed form, or the body that the scene gives.
/// `refine` raises the polynomial order, for error estimates; of a body from a file it takes the finer elements that
/// the file has. A solid body is kept in the folder `keep`, if one is given. It is read from there as long as what it
/// is made of is the same. @throws InputError, NumericalError.
PreparedBody prepare_body(const BodyScene&, int refine = 0, const std::filesystem::path& keep = {});

/// Bodies that were made, for runs with equal ones. They are told apart by all that they are made of. Threads may share
/// them.
class PreparedBodies {
 public:
  /// As prepare_body.
  PreparedBody get(const BodyScene&, int refine = 0, const std::filesystem::path& keep = {});

 private:
  std::mutex guard_;                           // solvers of modes bear one thread alone, too
  std::map<std::string, PreparedBody> whole_;  // with all shapes
};

}  // namespace flexboom
