#pragma once

#include "apps/simulate/drives.hpp"
#include "apps/simulate/simulate.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string>

namespace flexboom {

/// Kinds of modes that nothing moves, by the names of bodies.
using StillKinds = std::map<std::string, std::set<std::string>>;

/// Without modes of these kinds. @throws InputError, NumericalError as prepare_body, of the bodies that have such.
Scene without_kinds(Scene, const StillKinds&, const RunHooks&);

/// With as many modes as the elements have, `wanted` at most.
BodyScene with_modes(BodyScene, int wanted, const std::filesystem::path& keep, const RunHooks&);

/// How many modes more show what a model leaves out.
struct ModesBeyond {
  int least = 4;         // of each kind: the next two alone may happen to do little
  bool as_many = false;  // as are kept, where those are more

  int of(int kept) const { return as_many ? std::max(least, kept) : least; }
};

/// Clamped bodies get the lowest modes that are left out. They get the given number (ModesBeyond) of each kind that
/// they have. They get half as many of other kinds, for what bends out of the hinge plane is left out, too. Some of
/// these stretch and some twist. Static shapes of loads at the free end stand for them where no mode among many does.
/// Other bases get so many in each plane. Bodies from files get the modes that their files have beyond those kept.
/// Where the drives of the scene move faster vibrations than these show, booms get all modes up to there. Beams get
/// them of finer elements.
/// @throws InputError, NumericalError as prepare_body.
Scene with_more_modes(Scene, const ModesBeyond&, const DriveSpectra&, const RunHooks&);

/// @throws InputError where the drives of a scene move faster vibrations than its modes show.
void require_drives_shown(const Scene&, const DriveSpectra&, const RunHooks&);

}  // namespace flexboom
