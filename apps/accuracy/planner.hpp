#pragma once

#include "apps/accuracy/error_budget.hpp"
#include "apps/simulate/simulate.hpp"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// Chooses what stands for the bodies with modes = "auto": which of their modes, of which elements. The outputs wanted
/// decide: those of a run with many modes (the candidates) must change by no more than a third of the tolerance.
class Planner {
 public:
  explicit Planner(const Scene&);

  /// Candidates that no motion reaches are left out; of the others, the fewest that move most and are enough. Where the
  /// scene has no budget and all are needed, there are twice as many; where that ends, the scene gets a warning.
  /// Afterwards no body of the scene is left open. `plan` gets one line per body. False: there
  /// was nothing to choose, or more candidates than the last time are not bearable.
  /// @throws InputError, NumericalError as run_once, of the candidates.
  bool choose(Scene&, const RunHooks&, std::vector<std::string>& plan);

  /// A better model where the largest part of the budget's worst output is truncation (more candidates) or
  /// discretisation (finer elements). False: the budget is met, or what stops it is not for a plan to mend: another
  /// part, a truncation that more modes hardly change, or a force that is there at once when the run begins.
  bool improve(Scene&, const ErrorBudget&, const RunHooks&, std::vector<std::string>& plan);

  /// Kinds of which nothing moves any candidate, as symmetry has it: more of them are not tried.
  const StillKinds& still() const { return still_; }

 private:
  /// A mode of a body.
  struct Candidate {
    std::string body;
    int shape = 0;  // as BodyScene::shapes
    std::string kind;
    double displacement = 0;  // the largest at any time, root of its mean square over the mass: torsion counts, too [m]
  };

  struct Choice {
    double needed = 0;          // part of those that move
    double error_of_fewer = 0;  // of the most that are not enough
  };
  bool choose_as_flown(Scene&, const RunHooks&, std::vector<std::string>& plan);
  void choose_bases(Scene&, const RunHooks&, std::vector<std::string>& plan) const;
  std::optional<Choice> choose_among_candidates(Scene&, const RunHooks&, std::vector<std::string>& plan);
  /// Clamped bodies take theirs from so many that are `made`, and some for the budget: once for all runs.
  Scene with_candidates(const Scene&, int candidates, int made, const RunHooks&) const;
  /// Static shapes of the loads on a boom, of kinds that move.
  std::vector<std::string> moving_static_shapes(const Scene&, const BodyScene&) const;
  /// The run that the others are compared with, as precise as that takes: as many candidates as are bearable. `open`
  /// has them and leaves stiffening open, `all` has what was run. The scene gets the tolerance that the integrator
  /// needs: a run with few modes shows it as well as one with many. Nothing: no more candidates than those of the last
  /// choice are bearable.
  std::optional<Run> with_all(Scene&, const RunHooks&, Scene& open, Scene& all, std::vector<std::string>& plan);
  bool has_choice(const Scene&, const std::string& body) const;
  /// Bodies of bases without a choice have their first `modes` at most.
  Scene with_first_of_whole(Scene, size_t modes) const;
  size_t most_of_whole(const Scene&) const;
  std::vector<Candidate> ranked(const Scene&, const Run&) const;
  void note_still(const std::vector<Candidate>&);
  /// What is taken of a body and what is left out, of a list of which the first `moved` move.
  std::string words_of_choice(const std::string& body, const std::vector<Candidate>&, size_t moved, double error) const;
  bool is_hopeless_front(const OutputErrors&, double tolerance) const;
  /// Of the outputs that more modes or finer elements may mend; nullptr: those are within the tolerance.
  const OutputErrors* worst_to_mend(const Scene&, const ErrorBudget&, std::vector<std::string>& plan) const;
  bool choose_from_more(Scene&, const OutputErrors& worst, const Reach&, const RunHooks&,
                        std::vector<std::string>& plan);
  bool take_finer_elements(Scene&, const OutputErrors& worst, std::vector<std::string>& plan);
  Scene with_first(const Scene& all, const std::vector<Candidate>&, size_t count) const;

  void warn_of_tones(const Scene& given, Scene& chosen, const RunHooks&) const;

  /// Modes beside those of the plan that have shown its truncation: candidates, too, from then on. The plan gets the
  /// elements that these had.
  void note_shown(Scene& planned, const Reach&, const RunHooks&);

  std::vector<size_t> open_;                // bodies of the scene
  std::map<std::string, BodyScene> shown_;  // with these modes
  int candidates_ = 12;                     // per body
  int chosen_from_ = 0;                     // candidates of the last choice
  int steps_ = 0;                           // improvements so far
  size_t kept_ = 0;                         // modes of all bodies, of the last choice
  size_t too_few_ = 0;                      // at least so many are needed, as a budget has shown
  size_t kept_of_whole_ = 0;                // modes of each body whose basis has no choice, of the last choice
  size_t too_few_of_whole_ = 0;             // as too_few_
  StillKinds still_;
  bool is_timed_ = false;        // the scene has the tolerance that its integrator needs
  bool costly_ = false;          // more candidates are not bearable
  bool hopeless_ = false;        // nearly all are needed, and without the last of them errors are far too large
  double truncation_ = unknown;  // of the last step that was to make it less
  double discretisation_ = unknown;
};

}  // namespace flexboom
