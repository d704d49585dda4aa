#include "apps/base/usage.hpp"
#include "apps/base/version.hpp"
#include "apps/commands/commands.hpp"
#include "fem/base/blas_threads.hpp"
#include "fem/base/check.hpp"
#include "fem/base/heap.hpp"
#include "reduction/basis/basis.hpp"
#include "reduction/exports/exports.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <Eigen/Core>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <functional>
#include <map>
#include <sstream>
#include <system_error>

namespace {

using namespace flexboom;

/// The command line of the whole program. `action` is set by the sub-command that was given.
struct CommandLine {
  CLI::App app{"flexboom makes reduced flexible bodies from the geometry of booms, and simulates them."};
  CommonOptions common;
  RunArguments run;
  ModesArguments modes;
  MeshArguments mesh;
  ReduceArguments reduce;
  ExportArguments exported;
  std::filesystem::path inspected;
  BenchArguments bench;
  CompareArguments compare;
  SweepArguments sweep;
  std::string checked;
  std::string keys_of;
  std::filesystem::path reported;
  std::function<int()> action;

  CommandLine() {
    app.set_version_flag("--version", version_text());
    add_run();
    add_check();
    add_keys();
    add_modes();
    add_mesh();
    add_reduce();
    add_inspect();
    add_export();
    add_bench();
    add_compare();
    add_sweep();
    add_report();
  }

  CLI::App* command(const std::string& name, const std::string& what) {
    CLI::App* c = app.add_subcommand(name, what);
    c->add_flag("--json", common.json, "One JSON document on stdout, nothing else");
    c->add_flag("--quiet", common.quiet, "Print nothing but errors, and the document of --json");
    c->add_option("--out", common.out, "Output folder");
    c->add_option("--threads", common.threads, "Threads of the linear algebra")->check(CLI::Range(1, 1024));
    c->set_version_flag("--version", version_text());
    return c;
  }

  void add_run() {
    CLI::App* c = command("run", "scene -> models -> transient -> results folder");
    c->add_option("SCENE", run.scene, "Scene file, or the name of a built-in scene (sport, tumbling, ...)")->required();
    c->add_option("--duration", run.duration, "Simulated time [s]");
    c->add_option("--tolerance", run.tolerance, "Relative error wanted in the outputs");
    c->add_option("--modes", run.modes, "Elastic coordinates of every body: a number, or auto");
    c->add_option("--plan", run.plan,
                  "Models of the bodies as another run chose them: its results folder or scene.toml")
        ->excludes("--modes");
    c->add_option("--structure", run.structure, "Model of every body: beam, solid, eq14 or rigid");
    c->add_option("--formulation", run.formulation, "relative or multipliers");
    c->add_option("--integrator", run.integrator, "Integration method");
    c->add_option("--output-step", run.output_step, "Time between rows of trajectory.csv [s]");
    c->add_option("--vtu-step", run.vtu_step, "Time between .vtu files [s]; none by default");
    c->add_option("--continue", run.from, "Go on from the state that another run ended in: its results folder");
    c->add_flag("--force", run.force, "Go on from a state that was changed by hand, too");
    c->add_option("--checkpoint", run.checkpoint, "Wall time between two states on the disk [s]; 10 by default")
        ->check(CLI::NonNegativeNumber);
    c->add_flag("--report", run.report, "Write report.html too");
    c->add_flag("--loads", run.loads, "Force and torque of every joint as outputs: JOINT.force, JOINT.torque");
    c->add_flag("--no-budget", run.no_budget, "Do not repeat the run to measure its errors");
    c->add_flag("--verify", run.verify,
                "Hold the run against expensive ones that share little with it: another method, the other formulation, "
                "more modes, finer elements");
    c->callback([this] { action = [this] { return run_command(run, common); }; });
  }

  void add_check() {
    CLI::App* c = command("check", "Reads and checks everything, computes nothing, lists all faults");
    c->add_option("SCENE", checked, "Scene or body file, or the name of a built-in scene")->required();
    c->callback([this] { action = [this] { return check_command(checked, common); }; });
  }

  void add_keys() {
    CLI::App* c = command("keys", "Every key of scene and body files: unit, default, what it is");
    c->add_option("TABLE", keys_of, "One table alone, such as joints or bodies.segments");
    c->callback([this] { action = [this] { return keys_command(keys_of, common); }; });
  }

  void add_modes() {
    CLI::App* c = command("modes", "Eigenfrequencies and mode shapes of a body");
    c->add_option("MODEL", modes.model, "Body file (.toml) or mesh (.inp, .msh, .bdf, .vtu, .step, .geo)")->required();
    c->add_option("--count", modes.count, "Number of modes (default: what the file asks for, or 10)")
        ->check(CLI::Range(1, 1'000'000));
    c->add_option("--backend", modes.backend, "Eigen-solver: auto, arpack, block, spectra or dense");
    c->add_option("--verify", modes.verify, "Proof that no mode is missed: auto (where cheap), sturm, basic")
        ->check(CLI::IsMember({"auto", "sturm", "basic"}));
    c->add_option("--clamp", modes.options.clamp,
                  "Node set that is fixed (default: the body's, or the file's supports)");
    c->add_flag("--free", modes.options.free, "No clamp, no supports")->excludes("--clamp");
    c->add_option("--vtu", modes.vtu, "Write the shapes to this .vtu file");
    add_model_options(c, modes.options);
    c->callback([this] { action = [this] { return modes_command(modes, common); }; });
  }

  void add_mesh() {
    CLI::App* c = command("mesh", "geometry -> mesh file; or one mesh format into another");
    c->add_option("BODY", mesh.body, "Body file (.toml) or mesh")->required();
    c->add_option("-o,--output", mesh.file, "Mesh to write: .vtu, .msh or .inp")->required();
    add_model_options(c, mesh.options);
    c->callback([this] { action = [this] { return mesh_command(mesh, common); }; });
  }

  void add_reduce() {
    CLI::App* c = command("reduce", "mesh -> reduced body: basis, shapes, invariants, stiffening, certificate");
    c->add_option("BODY", reduce.model, "Body file (.toml) or mesh (.inp, .msh, .bdf, .vtu, .step, .geo)")->required();
    c->add_option("-o,--output", reduce.file, "Body to write (.h5)")->required();
    c->add_option("--basis", reduce.basis,
                  "clamped, hinge, mean-axis, craig-bampton or prestressed (default: the file's)")
        ->check(CLI::IsMember(std::vector<std::string>(basis_names.begin(), basis_names.end())));
    c->add_option("--count", reduce.count,
                  "Modes (default: what the file asks for, or 10; basis hinge: per stiffness, 1)");
    c->add_option("--backend", reduce.backend, "Eigen-solver: auto, arpack, block, spectra or dense");
    c->add_option("--clamp", reduce.options.clamp,
                  "Node set that is fixed (default: the body's, or the file's supports)");
    c->add_option("--interface", reduce.interfaces,
                  "Of craig-bampton: node set with coordinates of its own; SET:distributing for an RBE3 (repeatable)");
    c->add_option("--reference", reduce.reference, "Of craig-bampton: the interface that carries the body's frame");
    c->add_flag("--orthonormal", reduce.orthonormal, "Of craig-bampton: modes of the reduced body as coordinates");
    c->add_option("--attach", reduce.attachments, "Static correction for a load, SET.Fx ... SET.Mz (repeatable)");
    c->add_option("--hinge-stiffness", reduce.hinge_stiffness, "Of hinge: stiffness of each regime [N m/rad]")
        ->delimiter(',');
    c->add_option("--hinge-axis", reduce.hinge_axis, "Of hinge: axis through the origin, x,y,z (default 0,0,1)")
        ->delimiter(',')
        ->expected(3);
    c->add_option("--spin", reduce.spin, "Of prestressed: angular velocity of the body's frame, x,y,z [rad/s]")
        ->delimiter(',')
        ->expected(3);
    c->add_option("--acceleration", reduce.acceleration,
                  "Of prestressed: acceleration of the frame's origin less gravity, x,y,z [m/s^2]")
        ->delimiter(',')
        ->expected(3);
    c->add_option("--turns", reduce.turns,
                  "Of prestressed: axis about which the root turns freely, x, y, z or X,Y,Z (repeatable)");
    c->add_option("--select", reduce.select,
                  "Coordinates to keep: list:1,3 band:LOW,HIGH (Hz) mass:SHARE completeness:SHARE output:SET.uy,SHARE");
    c->add_option("--damping", reduce.damping,
                  "none, modal:ZETA, loss-factor:ETA or rayleigh:ALPHA,BETA (default: the file's)");
    c->add_flag("!--no-stiffening", reduce.stiffening, "Leave geometric stiffness out");
    c->add_option("--loads-at", reduce.loads_at, "Node sets where loads stiffen the body; all that move by default");
    c->add_option("--errors", reduce.errors,
                  "What the file keeps for the error budget of a run: all (a body with more modes and one of finer "
                  "elements; default), modes (the former) or none")
        ->check(CLI::IsMember(std::vector<std::string>(kept_for_errors.begin(), kept_for_errors.end())));
    add_model_options(c, reduce.options);
    c->callback([this] { action = [this] { return reduce_command(reduce, common); }; });
  }

  void add_sweep() {
    CLI::App* c = command("sweep", "scene -> many runs with varied keys -> one table");
    c->footer(
        "SPEC is a,b,c (numbers or words), lin:FIRST:LAST:COUNT, log:FIRST:LAST:COUNT, normal:MEAN:STANDARD_DEVIATION "
        "or uniform:LOWEST:HIGHEST. Where runs are drawn, each entry of a list is as likely.");
    c->add_option("SCENE", sweep.scene, "Scene file, or the name of a built-in scene (sport, tumbling, ...)");
    c->add_option(
         "--vary", sweep.vary,
         "KEY=SPEC (repeatable). KEY is a path such as hub.mass, hinges.NAME.P2, bodies.NAME.segments[0].length "
         "or hinges[*].P2. KEY1,KEY2=SPEC gives both one value; KEY1,KEY2*=SPEC multiplies each by one factor")
        ->allow_extra_args(false);
    c->add_option("-n,--runs", sweep.runs, "Number of runs to draw; of --indices, base points");
    c->add_option(
        "--sample", sweep.sample,
        "grid: every combination of lists (default where all are lists); random (default otherwise); lhs: Latin "
        "hypercube; sobol: points of Joe and Kuo, shifted by the seed, best with n a power of 2");
    c->add_option("--seed", sweep.seed, "Of the draws; 1 by default");
    c->add_flag("--indices", sweep.indices,
                "Sobol indices: how much of each quantity's variance each key makes. Needs --sample sobol and n*(d+2) "
                "runs for d keys that take more than one value");
    c->add_option(
         "--quantity", sweep.quantities,
         "COLUMN:max (of its size), COLUMN:rms, COLUMN:final or settle:COLUMN:FRACTION (repeatable). COLUMN is "
         "one of trajectory.csv, or a vector such as hub.rotation. Default: max and rms of attitudes, hinge "
         "angles and tips")
        ->allow_extra_args(false);
    c->add_flag("--loads", sweep.loads, "Force and torque of every joint as outputs; their peaks are quantities");
    c->add_flag("--trajectories", sweep.trajectories, "Keep every trajectory in sweep.h5");
    c->add_option("--jobs", sweep.jobs, "Processes (default: one per core)")->check(CLI::Range(1, 1024));
    c->add_flag("--resume", sweep.resume, "Go on where the journal in the output folder ends");
    c->add_option("--shard", sweep.shard, "i/n: the i-th of n parts of the runs, i from 1 to n");
    c->add_option("--merge", sweep.merge, "Folders of all shards; writes one table into --out");
    c->add_flag("--report", sweep.report, "Write report.html too");
    c->callback([this] { action = [this] { return sweep_command(sweep, common); }; });
  }

  void add_inspect() {
    CLI::App* c = command("inspect", "Prints mass properties, coordinate table and checks of a reduced body");
    c->add_option("FILE", inspected, "Reduced body (.h5)")->required();
    c->callback([this] { action = [this] { return inspect_command(inspected, common); }; });
  }

  void add_export() {
    CLI::App* c = command("export", "Reduced body in another program's format");
    c->add_option("FILE", exported.body, "Reduced body (.h5)")->required();
    c->add_option("--to", exported.format, "Format: " + export_formats())->required();
    c->add_option("-o,--output", exported.path, "File or folder to write")->required();
    c->add_option("--set", exported.settings, "Setting of the format, NAME=VALUE (repeatable)");
    c->callback([this] { action = [this] { return export_command(exported, common); }; });
  }

  static std::string export_formats() {
    std::string names;
    for (const Exporter& e : exporters()) names += (names.empty() ? "" : ", ") + std::string(e.name);
    return names;
  }

  void add_bench() {
    CLI::App* c = command("bench", "speed against error, measured: modes, reduction, transient");
    c->add_option("WHAT", bench.what, "modes, reduction or transient")
        ->required()
        ->check(CLI::IsMember({"modes", "reduction", "transient"}));
    c->add_option("SCENE", bench.scenes, "Of transient: scenes instead of its own four");
    c->add_option("--longest", bench.longest, "Leave out models that would take longer than this [s]");
    c->callback([this] {
      require_usage(bench.what == "transient" || bench.scenes.empty(),
                    fmt::format("bench {} has models of its own; only transient takes scenes", bench.what));
      const auto command = bench.what == "modes"       ? bench_modes_command
                           : bench.what == "reduction" ? bench_reduction_command
                                                       : bench_transient_command;
      action = [this, command] { return command(bench, common); };
    });
  }

  static void add_model_options(CLI::App* c, ModelOptions& options) {
    c->add_option("--material", options.material, "E,nu,rho of everything, instead of the file's");
    c->add_option("--structure", options.structure, "Of a body file: beam or solid");
    c->add_option("--element", options.element, "Of a solid body: hex, hex8, hex20, ...");
    c->add_option("--order", options.order, "Polynomial order of beams and of hex");
    c->add_option("--accuracy", options.accuracy, "Relative error wanted in the frequencies of a solid body");
    const std::map<std::string, Dialect> dialects = {{"calculix", Dialect::calculix}, {"abaqus", Dialect::abaqus}};
    c->add_option("--dialect", options.read.dialect,
                  "Program that a deck (.inp) is for, where the deck does not tell: calculix or abaqus")
        ->transform(CLI::CheckedTransformer(dialects));
    c->add_flag("--trust", options.read.trust, "Let a .geo file run commands and write files");
  }

  void add_compare() {
    CLI::App* c = command("compare", "FE modes, S and invariants against eq. 14 and the closed forms");
    c->add_option("BODY", compare.body, "Body file, scene file, or the name of a built-in scene")->required();
    c->add_option("--count", compare.count, "Bending modes to compare")->check(CLI::Range(1, 50));
    c->add_option("--tolerance", compare.tolerance, "Largest relative error; above it the exit code is 5");
    c->add_option("--elements", compare.elements, "Elements per boom")->check(CLI::Range(1, 10000));
    c->add_flag("--no-transient", compare.no_transient, "Of a scene, compare the bodies only");
    c->callback([this] { action = [this] { return compare_command(compare, common); }; });
  }

  void add_report() {
    CLI::App* c = command("report", "results folder -> one self-contained HTML file");
    c->add_option("DIR", reported, "Results folder of a run")->required();
    c->callback([this] { action = [this] { return report_command(reported, common); }; });
  }
};

/// Text still on its way to stdout must arrive: a full disk behind a redirection is an error, not a success.
void flush_stdout() {
  errno = 0;
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw InputError(fmt::format("cannot write to standard output: {}", std::strerror(errno)));
}

/// Parses the line and runs its command. @throws InputError, NumericalError.
int run_line(int argc, char** argv) {
  CommandLine line;
  try {
    line.app.parse(argc, argv);
    if (!line.action) throw CLI::RequiredError("A command");
  } catch (const CLI::ParseError& e) {
    std::ostringstream out, err;
    const int code = line.app.exit(e, out, err) == 0 ? exit_ok : exit_usage;
    std::fputs(err.str().c_str(), stderr);
    fmt::print("{}", out.str());
    flush_stdout();
    return code;
  }
  Eigen::setNbThreads(line.common.threads);
  set_blas_threads(line.common.threads);
  const int code = line.action();
  flush_stdout();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  restart_with_better_blas_kernels(argv);
  keep_freed_memory();
  factors_on_huge_pages();
  std::signal(SIGPIPE, SIG_IGN);
#ifdef SIGXFSZ
  std::signal(SIGXFSZ, SIG_IGN);  // a full quota is an error of write(), not a death
#endif
  try {
    return run_line(argc, argv);
  } catch (const UsageError& e) {
    print_note(fmt::format("error: {}", e.what()));
    return exit_usage;
  } catch (const InputError& e) {
    print_note(fmt::format("error: {}", e.what()));
    return exit_input;
  } catch (const std::system_error& e) {  // the operating system refused: a file, a folder, a stream
    print_note(fmt::format("error: {}", e.what()));
    return exit_input;
  } catch (const NumericalError& e) {
    print_note(fmt::format("error: {}", e.what()));
    return exit_numerical;
  } catch (const std::exception& e) {
    print_note(fmt::format("internal error: {}", e.what()));
    return exit_numerical;
  }
}
