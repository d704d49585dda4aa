#pragma once

#include "apps/sweep/sampling.hpp"
#include "apps/sweep/scene_source.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// What one `--vary KEY=SPEC` says: keys that vary together, and what they take.
struct Variation {
  enum class Kind { list, normal, uniform };
  std::string name;               // left of the sign, with its * where it is a factor
  std::vector<std::string> keys;  // paths
  bool factor = false;            // multiplies what the scene says, instead of replacing it
  Kind kind = Kind::list;
  std::vector<KeyVariant> list;
  double a = 0, b = 0;  // mean and standard deviation, or both ends

  /// Can it take more than one value?
  bool varies() const { return kind != Kind::list || list.size() > 1; }

  /// What a coordinate u in (0, 1) stands for: the quantile of a distribution, each entry of a list as likely.
  KeyVariant at(double u) const;
};

/// @throws InputError for text that is no variation.
Variation variation_of(const std::string& text);

/// Changes a scene. @throws InputError as SceneSource.
void apply(const Variation&, const KeyVariant&, SceneSource&);

/// What a sweep is asked to run.
struct SweepDesign {
  std::vector<std::string> vary;  // as typed
  std::optional<size_t> n;
  std::string sample;  // empty: grid where all are lists, else random
  std::uint64_t seed = 1;
  bool indices = false;
};

/// The values of every run.
class SweepValues {
 public:
  /// @throws InputError for a design that is not one.
  explicit SweepValues(const SweepDesign&);

  const std::vector<Variation>& variations() const { return variations_; }
  Sampling sampling() const { return sampling_; }
  size_t runs() const { return runs_; }
  /// Base points of Sobol indices; 0 where none are wanted.
  size_t base_points() const { return base_points_; }
  /// Numbers of the variations that have indices: a list of one value has none, and costs no runs.
  const std::vector<size_t>& varying() const { return varying_; }
  /// One per variation.
  std::vector<KeyVariant> of_run(size_t run) const;

 private:
  std::vector<Variation> variations_;
  Sampling sampling_ = Sampling::grid;
  size_t runs_ = 0, base_points_ = 0;
  std::vector<size_t> varying_;
  std::shared_ptr<const UnitPoints> points_;  // of any sampling but the grid
};

/// The scene with the values of a run. @throws InputError.
SceneSource with_values(SceneSource, const std::vector<Variation>&, const std::vector<KeyVariant>&);

/// Every key is one of the scene language, none is varied twice, and a scene with some value of each can be read.
/// @throws InputError.
void check_variations(const SceneSource&, const SweepValues&);

}  // namespace flexboom
