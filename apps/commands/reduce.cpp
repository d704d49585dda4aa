#include "apps/commands/commands.hpp"
#include "apps/commands/terminal_line.hpp"
#include "apps/model/body_text.hpp"
#include "apps/model/reduction.hpp"
#include "apps/model/richer_bodies.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

namespace flexboom {

int reduce_command(const ReduceArguments& a, const CommonOptions& common) {
  require(a.file.extension() == ".h5" || a.file.extension() == ".hdf5",
          fmt::format("-o {}: a reduced body is an HDF5 file, name it .h5; other formats by `flexboom export`",
                      a.file.string()));
  const Stopwatch clock;
  std::optional<WorkLine> progress(std::in_place, !common.quiet && !common.json, "reduce");
  Model model = load_model(a.model, a.options);
  ReductionSeconds seconds{.mesh = clock.seconds()};
  const ReductionOptions options = reduction_options(a, model);
  const Model loaded = model;  // the reduction may add to its mesh
  const ReducedBody body = make_reduced_body(model, options, common.threads, seconds);
  if (model.body && model.body->structure == "beam")
    if (std::string doubt = doubt_of_modes(model.body->geometry, body); !doubt.empty())
      model.notes.push_back(std::move(doubt));
  const Stopwatch richer_clock;
  const RicherBodies richer = richer_bodies(loaded, options, body, a.errors, common.threads, model.notes);
  seconds.richer = richer_clock.seconds();
  write_body_file(a.file, body, richer);
  progress.reset();
  seconds.total = clock.seconds();
  if (common.json) {
    auto document = body_json(body, body.certificate, model.notes);
    document["seconds"] = seconds_json(seconds);
    fmt::print("{}\n", document.dump(2));
  } else if (!common.quiet) {
    for (const std::string& note : model.notes) print_note("note: " + note);
    fmt::print("{}", description(body, body.certificate));
    print_note(fmt::format(
        "{}: {:.2f} s, of these modes {:.2f}, invariants {:.2f}, geometric stiffness {:.2f}, bodies for "
        "error estimates {:.2f}",
        a.file.string(), seconds.total, seconds.modes, seconds.invariants, seconds.stiffening, seconds.richer));
  }
  return std::ranges::all_of(body.certificate, &BodyCheck::passed) ? exit_ok : exit_check_failed;
}

}  // namespace flexboom
