#include "apps/simulate/flights_ahead.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <system_error>
#include <thread>
#include <utility>

namespace flexboom {

namespace {

/// Equal for equal flights alone: bodies that were read are told apart by where they are, not by their files.
std::string all_of(const Scene& scene, int refine) {
  std::string text = fmt::format("{} {} {}", refine, scene.gravity_strength, to_toml(scene));
  for (const BodyScene& b : scene.bodies) text += fmt::format("{} ", static_cast<const void*>(b.reduced.get()));
  return text;
}

}  // namespace

void FlightsAhead::begin(const Scene& scene, const RunHooks& hooks, int refine, long max_steps) {
  std::string made_of = all_of(scene, refine);
  if (hooks.bodies == nullptr || std::thread::hardware_concurrency() < 2 ||
      std::ranges::find(begun_, made_of, &Flight::made_of) != begun_.end())
    return;
  RunHooks quiet;
  quiet.interrupt = &stop_, quiet.bodies = hooks.bodies;
  const auto flight = [scene, quiet, refine, max_steps] { return run_once(scene, quiet, refine, max_steps); };
  if (!alone_) alone_.emplace();
  try {
    begun_.push_back({std::move(made_of), std::async(std::launch::async, flight)});
  } catch (const std::system_error&) {  // no thread to be had
    if (begun_.empty()) alone_.reset();
  }
}

void FlightsAhead::give_up() {
  stop_ = true;
  begun_.clear();  // waits
  alone_.reset();
  stop_ = false;
}

void FlightsAhead::keep(const Scene& scene, Run run) { kept_made_of_ = all_of(scene, 0), kept_ = std::move(run); }

std::optional<Run> FlightsAhead::take(const Scene& scene, const RunHooks& hooks, int refine) {
  const std::string made_of = all_of(scene, refine);
  if (kept_ && kept_made_of_ == made_of) return std::exchange(kept_, {});
  const auto flight = std::ranges::find(begun_, made_of, &Flight::made_of);
  if (flight == begun_.end()) return {};
  constexpr std::chrono::milliseconds moment{20};
  while (flight->run.wait_for(moment) != std::future_status::ready)
    if (hooks.stopped()) stop_ = true;  // for good: all that is begun ends
  std::future<Run> run = std::move(flight->run);
  begun_.erase(flight);
  if (begun_.empty()) alone_.reset();
  return run.get();
}

Run fly(const Scene& scene, const RunHooks& hooks, int refine, long max_steps) {
  if (hooks.ahead != nullptr)
    if (std::optional<Run> flown = hooks.ahead->take(scene, hooks, refine)) return *std::move(flown);
  return run_once(scene, hooks, refine, max_steps);
}

void fly_ahead(const Scene& scene, const RunHooks& hooks, int refine, long max_steps) {
  if (hooks.ahead != nullptr) hooks.ahead->begin(scene, hooks, refine, max_steps);
}

void give_up_ahead(const RunHooks& hooks) {
  if (hooks.ahead != nullptr) hooks.ahead->give_up();
}

void keep_flown(const Scene& scene, Run run, const RunHooks& hooks) {
  if (hooks.ahead != nullptr) hooks.ahead->keep(scene, std::move(run));
}

}  // namespace flexboom
