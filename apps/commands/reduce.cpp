#include "apps/model/reduction.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"
#include "reduction/body_file/body_file.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexboom {

int reduce_command(const ReduceArguments& a, const CommonOptions& common) {
  require(a.file.extension() == ".h5" || a.file.extension() == ".hdf5",
          fmt::format("-o {}: a reduced body is an HDF5 file, name it .h5; other formats by `flexboom export`",
                      a.file.string()));
  const Stopwatch clock;
  Model model = load_model(a.model, a.options);
  ReductionSeconds seconds{.mesh = clock.seconds()};
  const ReductionOptions options = reduction_options(a, model);
  Model again = model;
  const ReducedBody body = make_reduced_body(model, options, common.threads, seconds);
  Stopwatch richer_clock;
  const size_t notes = again.notes.size();
  const RicherBodies richer = richer_bodies(again, options, body, a.errors, common.threads);
  model.notes.insert(model.notes.end(), again.notes.begin() + static_cast<std::ptrdiff_t>(notes), again.notes.end());
  seconds.richer = richer_clock.lap();
  write_body_file(a.file, body, richer);
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
