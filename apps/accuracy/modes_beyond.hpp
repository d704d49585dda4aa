#pragma once

#include "apps/accuracy/drive_spectra.hpp"
#include "apps/accuracy/motion_spectra.hpp"
#include "apps/simulate/simulate.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

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

/// Frequencies up to which modes must go, by the names of bodies [rad/s].
using Reach = std::map<std::string, double>;

/// Clamped bodies get the lowest modes that are left out. They get the given number (ModesBeyond) of each kind that
/// they have. They get half as many of other kinds, for what bends out of the hinge plane is left out, too. Some of
/// these stretch and some twist. Static shapes of loads at the free end stand for them where no mode among many does.
/// Other bases get so many in each plane. Bodies from files get the modes that their files have beyond those kept.
/// Booms get all modes up to their reach, where they have one. Beams get them of finer elements.
/// @throws InputError, NumericalError as prepare_body.
Scene with_more_modes(Scene, const ModesBeyond&, const Reach&, const RunHooks&);

/// Of bodies whose vibrations the drives of the scene shake faster than such modes show.
/// @throws InputError, NumericalError as prepare_body.
Reach reach_of_drives(const Scene&, const ModesBeyond&, const DriveSpectra&, const RunHooks&);

/// Modes by the names of bodies.
using ShakenModes = std::map<std::string, std::vector<ShakenMode>>;

/// What the motion of a run does to modes beyond those. `flown`: the scene as it was flown. @throws InputError,
/// NumericalError as prepare_body and MotionSpectra.
ShakenModes shaken_modes(const Scene& flown, const SimulatedMotion& run, const ModesBeyond&, const Reach&,
                         const RunHooks&);

/// A mode is worth taking in where its effect is so much of the tolerance.
inline constexpr double counting_effect = 0.1;

/// A reach that has all modes whose effect is more than the least.
Reach with_shaken(Reach, const ShakenModes&, double least);
bool any_counts(const ShakenModes&, double least);

/// @throws InputError where the modes of a scene with more of them end before their reach.
void require_reached(const Scene&, const Reach&, const RunHooks&);

/// @throws InputError where the drives of a scene move faster vibrations than its modes show.
void require_drives_shown(const Scene&, const DriveSpectra&, const RunHooks&);

}  // namespace flexboom
