#pragma once

#include "dynamics/events/flight.hpp"
#include "dynamics/relative/tree.hpp"

#include <Eigen/Core>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

/// The state that a run ends in, as a file (`state.toml` of a results folder) from which another run goes on.
namespace flexboom {

/// A moment of a flight, every number under its name.
struct FlightState {
  double time = 0;  // [s]
  int events = 0;   // in the events.csv beside it, until then
  std::vector<std::string> names;
  Eigen::VectorXd y;                               // by names
  std::map<std::string, int> modes;                // by body
  std::map<std::string, std::vector<int>> shapes;  // by body, of those that some of the modes stand for (BodyScene)
  std::map<std::string, std::vector<std::string>> corrections;  // by body, of those that have static shapes
  std::map<std::string, StopHistory> stops;                     // by hinge or joint
  MotionScales largest;                                         // by which balances are judged
  std::map<std::string, double> loops;  // angles of hinges that close loops [rad]: which turn they are in
};

/// Names of the states of a tree, in the order of its layout.
std::vector<std::string> state_names(const Tree&);

/// With a checksum of everything else in it.
std::string to_toml(const FlightState&, const std::string& scene);

/// A state that was read. Which numbers it must have is known when the scene is made.
class SavedState {
 public:
  /// The file, or `state.toml` of a folder. @throws InputError file:line:column for what is not such a file, and for
  /// one that was changed after it was written, unless that is what is wanted.
  static SavedState read(const std::filesystem::path&, bool changed_too = false);
  ~SavedState();
  SavedState(SavedState&&) noexcept;

  const std::filesystem::path& file() const;
  double time() const;
  int events() const;
  const std::map<std::string, int>& modes() const;
  const std::map<std::string, std::vector<int>>& shapes() const;
  const std::map<std::string, std::vector<std::string>>& corrections() const;
  const MotionScales& largest() const;

  /// The numbers of these names. @throws InputError naming each that is missing, not finite or too many.
  Eigen::VectorXd values(const std::vector<std::string>& names) const;

  /// Of hinges or joints; those that the file does not know were never met.
  std::vector<StopHistory> stops(const std::vector<std::string>& names) const;

  /// The angle of a hinge that closes a loop, or `otherwise`.
  double loop_angle(const std::string& joint, double otherwise) const;

 private:
  struct Content;
  explicit SavedState(std::unique_ptr<const Content>);
  std::unique_ptr<const Content> content_;
};

}  // namespace flexboom
