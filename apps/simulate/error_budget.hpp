#pragma once

#include "apps/simulate/simulate.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace flexboom {

/// Steps that a flight in comparison with another may take; beyond, it costs too much.
long bearable_steps(const Run&);

/// Kinds of modes that nothing moves, by the names of bodies.
using StillKinds = std::map<std::string, std::set<std::string>>;

/// Without modes of these kinds. @throws InputError, NumericalError as prepare_body, of the bodies that have such.
Scene without_kinds(Scene, const StillKinds&, const RunHooks&);

/// Repeats a run ten times tighter until its outputs change by no more than a third of the accuracy wanted, for there
/// are other errors: so many digits more at most. `run` is then the last but one, `flown` has the tolerance of its
/// integrator, and `plan` says so. Returns the last differences. @throws InputError, NumericalError as run_scene.
std::vector<OutputDifference> settle_time_error(Scene& flown, Run& run, const OutputFloors&, int digits,
                                                const RunHooks&, std::vector<std::string>& plan);

/// Repeats a run with a tighter integrator, more modes in and out of the hinge plane, and a finer mesh, and compares
/// the outputs wanted. Where the integrator has to be tighter, that run takes the place of `run`, and the scene gets
/// its tolerance. What is known not to move is no part of more modes.
/// @throws InputError, NumericalError as run_scene.
ErrorBudget measure_budget(Scene&, Run& run, const RunHooks&, std::vector<std::string>& plan,
                           const StillKinds& still = {});

/// With as many modes as the elements have, `wanted` at most.
BodyScene with_modes(BodyScene, int wanted, const std::filesystem::path& keep, const RunHooks&);

/// How many modes more show what a model leaves out.
struct ModesBeyond {
  int least = 4;         // of each kind: the next two alone may happen to do little
  bool as_many = false;  // as are kept, where those are more

  int of(int kept) const { return as_many ? std::max(least, kept) : least; }
};

/// Clamped bodies get the lowest modes that are left out: so many of each kind that they have, half as many of others,
/// for what bends out of the hinge plane is left out, too. Some stretch and some twist; static shapes of loads at the
/// free end stand for them where no mode among many does.
/// Other bases get so many in each plane. Bodies from files get the modes that their files have beyond those kept.
/// @throws InputError, NumericalError as prepare_body.
Scene with_more_modes(Scene, const ModesBeyond&, const RunHooks&);

/// The scene with the geometric stiffness that its run had: a repeat changes one thing alone.
Scene as_flown(Scene, const Run&);

/// All geometric stiffness.
Scene with_stiffening(Scene);

/// Without the columns of elastic coordinates: those of another basis have other meanings.
OutputTable without_coordinates(const OutputTable&);

/// What the outputs of a scene with these bodies must bear.
OutputFloors floors_of(const Scene&, const std::vector<PreparedBody>&);

}  // namespace flexboom
