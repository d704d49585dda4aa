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
  const ReducedBody body = make_reduced_body(model, reduction_options(a, model), common.threads, seconds);
  write_body_file(a.file, body);
  seconds.total = clock.seconds();
  if (common.json) {
    auto document = body_json(body, body.certificate, model.notes);
    document["seconds"] = seconds_json(seconds);
    fmt::print("{}\n", document.dump(2));
  } else if (!common.quiet) {
    for (const std::string& note : model.notes) print_note("note: " + note);
    fmt::print("{}", description(body, body.certificate));
    print_note(fmt::format("{}: {:.2f} s, of these modes {:.2f}, invariants {:.2f}, geometric stiffness {:.2f}",
                           a.file.string(), seconds.total, seconds.modes, seconds.invariants, seconds.stiffening));
  }
  return std::ranges::all_of(body.certificate, &BodyCheck::passed) ? exit_ok : exit_check_failed;
}

}  // namespace flexboom
