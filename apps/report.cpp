#include "apps/report.hpp"

#include "apps/plot.hpp"
#include "apps/scene.hpp"
#include "fem/check.hpp"
#include "fem/files.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>

namespace flexboom {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;  // tables in the order of the file

namespace {

constexpr double degrees = 180 / std::numbers::pi;

/// Columns of a trajectory.csv by name.
struct Table {
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;

  const std::vector<double>& column(const std::string& name) const {
    const auto i = std::find(names.begin(), names.end(), name);
    require(i != names.end(), fmt::format("trajectory.csv has no column '{}'", name));
    return columns[static_cast<size_t>(i - names.begin())];
  }
};

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> parts;
  std::istringstream in(line);
  for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
  return parts;
}

/// Of a run that was killed the last line may be a part of one: that is left out.
Table read_table(const fs::path& path, bool whole) {
  std::string text = file_bytes(path);
  if (!whole) text.resize(text.rfind('\n') + 1);
  std::istringstream in(text);
  std::string line;
  Table table;
  std::getline(in, line);
  table.names = split(line);
  table.columns.resize(table.names.size());
  for (size_t number = 2; std::getline(in, line); ++number) {
    const std::vector<std::string> parts = split(line);
    require(parts.size() == table.names.size(), fmt::format("{}:{}: {} values, the header names {}", path.string(),
                                                            number, parts.size(), table.names.size()));
    for (size_t i = 0; i < parts.size(); ++i) {
      double v = 0;
      const auto [end, error] = std::from_chars(parts[i].data(), parts[i].data() + parts[i].size(), v);
      require(error == std::errc() && end == parts[i].data() + parts[i].size(),
              fmt::format("{}:{}: '{}' is not a number", path.string(), number, parts[i]));
      table.columns[i].push_back(v);
    }
  }
  require(!table.columns.empty() && !table.columns[0].empty(), path.string() + ": no rows");
  return table;
}

struct Folder {
  Scene scene;
  Table table;
  json summary;
};

Folder read_folder(const fs::path& folder) {
  Folder f{read_scene(folder / "scene.toml"), {}, {}};
  const fs::path summary = folder / "summary.json";
  try {
    f.summary = json::parse(file_bytes(summary));
    const json& status = f.summary.at("status");
    require(f.summary.contains("simulated_seconds"),
            fmt::format("{}: this run has no rows: {}", summary.string(),
                        f.summary.contains("error") ? f.summary["error"].dump() : status.dump()));
    f.table = read_table(folder / "trajectory.csv", status != "running" && status != "failed");
  } catch (const json::exception& e) {
    throw InputError(fmt::format("{}: {}", summary.string(), e.what()));
  }
  return f;
}

/// What a reader must know before anything else.
std::string status_line(const json& summary) {
  const std::string status = summary.at("status").get<std::string>();
  if (status == "finished") return "";
  if (status == "running") return "<p><b>This run is under way, or was killed. Its last checkpoint is shown.</b></p>\n";
  return fmt::format("<p><b>This run {}{}.</b></p>\n", status == "failed" ? "failed" : "was interrupted",
                     summary.contains("error") ? ": " + escaped(summary["error"].get<std::string>()) : "");
}

Curve curve(const Table& table, const std::string& column, const std::string& name, double factor = 1,
            double offset = 0) {
  Curve c{name, table.column("t"), table.column(column)};
  for (double& v : c.y) v = factor * (v - offset);
  return c;
}

/// Of a scene with joints: what each output of its joints and bodies does over time.
std::vector<Plot> tree_plots(const Folder& f) {
  const Table& t = f.table;
  std::vector<Plot> all;
  Plot angles{"Joint angles", "t [s]", "angle [deg]", {}}, lengths{"Sliders", "t [s]", "length [m]", {}};
  for (const JointScene& j : f.scene.joints) {
    if (j.kind == JointKind::hinge) angles.curves.push_back(curve(t, j.name + ".angle", j.name, degrees));
    if (j.kind == JointKind::universal)
      for (const char* which : {".angle1", ".angle2"})
        angles.curves.push_back(curve(t, j.name + which, j.name + which, degrees));
    if (j.kind == JointKind::slider) lengths.curves.push_back(curve(t, j.name + ".length", j.name));
    if (!joint_type(j.kind).turns) continue;
    Plot rotation{"Rotation of " + j.name, "t [s]", "rotation vector [deg]", {}};
    for (const char* axis : {".x", ".y", ".z"})
      rotation.curves.push_back(curve(t, j.name + ".rotation" + axis, axis + 1, degrees));
    all.push_back(rotation);
  }
  Plot tip{"Elastic tip displacement, axes of the body", "t [s]", "displacement [mm]", {}};
  for (const BodyScene& b : f.scene.bodies)
    for (const std::string axis : {".y", ".z"})
      if (std::find(t.names.begin(), t.names.end(), b.name + ".tip" + axis) != t.names.end())
        tip.curves.push_back(curve(t, b.name + ".tip" + axis, b.name + axis, 1e3));
  Plot energy{"Energy", "t [s]", "energy [J]", {}};
  for (const char* kind : {"kinetic", "elastic", "potential", "dissipated", "work"})
    energy.curves.push_back(curve(t, std::string("energy.") + kind, kind));
  for (Plot* p : {&angles, &lengths, &tip, &energy})
    if (!p->curves.empty()) all.push_back(std::move(*p));
  return all;
}

std::vector<Plot> plots(const Folder& f) {
  if (f.scene.is_tree) return tree_plots(f);
  const Table& t = f.table;
  std::vector<Plot> all;
  Plot rotation{"Hub rotation from the start", "t [s]", "rotation vector [deg]", {}};
  for (const char* axis : {"x", "y", "z"})
    rotation.curves.push_back(curve(t, std::string("hub.rotation.") + axis, axis, degrees));
  all.push_back(rotation);
  Plot angle{"Hinge angle, from the stop", "t [s]", "Theta - threshold [deg]", {}};
  for (const HingeScene& h : f.scene.hinges)
    angle.curves.push_back(curve(t, h.body + ".angle", h.body, degrees, h.hinge.mechanism.threshold));
  if (!angle.curves.empty()) all.push_back(angle);
  Plot tip{"Elastic tip deflection in the hinge plane", "t [s]", "tip.y [mm]", {}};
  for (const HingeScene& h : f.scene.hinges) tip.curves.push_back(curve(t, h.body + ".tip.y", h.body, 1e3));
  if (!tip.curves.empty()) all.push_back(tip);
  Plot energy{"Energy", "t [s]", "energy [J]", {}};
  for (const char* kind : {"kinetic", "elastic", "dissipated"})
    energy.curves.push_back(curve(t, std::string("energy.") + kind, kind));
  all.push_back(energy);
  return all;
}

std::string cell(const json& v) {
  if (v.is_number_float()) return fmt::format("{:.4g}", v.get<double>());
  if (v.is_null()) return "not measured";
  return v.is_string() ? escaped(v.get<std::string>()) : v.dump();
}

std::string rows(const json& object, const std::string& prefix = "") {
  std::string r;
  for (const auto& [key, value] : object.items())
    if (!value.is_structured())
      r += fmt::format("<tr><th>{}{}</th><td>{}</td></tr>\n", prefix, escaped(key), cell(value));
  return r;
}

std::string bodies_table(const json& bodies) {
  std::string r =
      "<table><tr><th>body</th><th>structure</th><th>unknowns</th><th>modes</th><th>frequencies, clamped "
      "[Hz]</th></tr>\n";
  for (const json& b : bodies) {
    std::string hz;
    for (const json& f : b.at("frequencies_hz")) hz += fmt::format("{}{:.6g}", hz.empty() ? "" : ", ", f.get<double>());
    r += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", cell(b.at("name")),
                     cell(b.at("structure")), cell(b.at("dofs")), cell(b.at("modes")), hz);
  }
  return r + "</table>\n";
}

/// Data of the moving picture: per boom its hinge and length, per frame time, hub rotation, hinge angles and tip
/// deflections.
json animation_data(const Folder& f) {
  constexpr size_t most_frames = 600;
  json booms = json::array();
  for (const HingeScene& h : f.scene.hinges) {
    const auto b = std::find_if(f.scene.bodies.begin(), f.scene.bodies.end(),
                                [&](const BodyScene& s) { return s.name == h.body; });
    const auto v = [](const Eigen::Vector3d& a) { return json{a.x(), a.y(), a.z()}; };
    booms.push_back({{"name", h.body},
                     {"point", v(h.hinge.point)},
                     {"s", v(h.hinge.stowed)},
                     {"n", v(h.hinge.outward)},
                     {"length", b == f.scene.bodies.end() ? 0.0 : b->geometry.length()}});
  }
  const std::vector<double>& t = f.table.column("t");
  const size_t stride = std::max<size_t>(1, t.size() / most_frames);
  json frames = json::array();
  double most = 0;
  for (size_t i = 0; i < t.size(); i += stride) {
    json frame = {t[i]};
    for (const char* axis : {"x", "y", "z"}) frame.push_back(f.table.column(std::string("hub.rotation.") + axis)[i]);
    for (const HingeScene& h : f.scene.hinges) {
      const double tip = f.table.column(h.body + ".tip.y")[i];
      most = std::max(most, std::abs(tip));
      frame.push_back(f.table.column(h.body + ".angle")[i]);
      frame.push_back(tip);
    }
    frames.push_back(frame);
  }
  const double exaggeration = most > 0 ? std::pow(10, std::floor(std::log10(0.1 / most))) : 1;
  const Eigen::Vector3d& size = f.scene.hub.size;
  return {{"size", {size.x(), size.y(), size.z()}},
          {"booms", booms},
          {"frames", frames},
          {"deflection", std::max(1.0, exaggeration)},
          {"rotation", 30}};
}

constexpr const char* style =
    R"(<style>body{font:15px sans-serif;max-width:820px;margin:2em auto;color:#222}table{border-collapse:collapse;margin:1em 0}
td,th{border:1px solid #ccc;padding:3px 9px;text-align:left;font-variant-numeric:tabular-nums}th{background:#f4f4f4;font-weight:600}
canvas{border:1px solid #ccc;width:100%}li{margin:.2em 0}</style>)";

// Orthographic view; boom curves are drawn with the static bending line of a tip force scaled to the tip deflection.
constexpr const char* player = R"(<script>
const c=document.getElementById('view'),g=c.getContext('2d'),R=(a,b,t)=>{const q=Math.hypot(...a)||1e-30,k=a.map(v=>v/q),s=Math.sin(q*t),o=Math.cos(q*t),
d=k[0]*b[0]+k[1]*b[1]+k[2]*b[2];return[0,1,2].map(i=>b[i]*o+(k[(i+1)%3]*b[(i+2)%3]-k[(i+2)%3]*b[(i+1)%3])*s+k[i]*d*(1-o));};
const P=v=>[410+560*(.80*v[0]+.60*v[2]),210-560*(.85*v[1]+.32*v[0]-.42*v[2])];
let n=0,run=true;c.onclick=()=>run=!run;
function line(a,col,w){g.beginPath();a.forEach((v,i)=>{const p=P(v);i?g.lineTo(...p):g.moveTo(...p)});g.strokeStyle=col;g.lineWidth=w;g.stroke();}
function draw(){const f=D.frames[n],r=f.slice(1,4),T=v=>R(r,v,D.rotation);g.clearRect(0,0,c.width,c.height);
const h=D.size.map(v=>v/2);for(const z of[-1,1])line([[-1,-1],[1,-1],[1,1],[-1,1],[-1,-1]].map(([x,y])=>T([x*h[0],y*h[1],z*h[2]])),'#444',1);
for(const[x,y]of[[-1,-1],[1,-1],[1,1],[-1,1]])line([-1,1].map(z=>T([x*h[0],y*h[1],z*h[2]])),'#444',1);
D.booms.forEach((b,i)=>{const th=f[4+2*i],w=f[5+2*i]*D.deflection,C=Math.cos(th),S=Math.sin(th),pts=[];
for(let k=0;k<=20;k++){const x=k/20,y=w*x*x*(3-x)/2;pts.push(T([0,1,2].map(j=>b.point[j]+b.length*x*(C*b.s[j]+S*b.n[j])+y*(C*b.n[j]-S*b.s[j]))));}
line(pts,['#0072b2','#d55e00','#009e73','#cc79a7','#e69f00','#56b4e9'][i%6],3);});
g.fillStyle='#222';g.font='14px sans-serif';g.fillText('t = '+f[0].toFixed(3)+' s',12,20);
if(run)n=(n+1)%D.frames.length;requestAnimationFrame(draw);}draw();</script>)";

/// @throws json::exception when the summary lacks something.
std::string page(const Folder& f) {
  const json& s = f.summary;
  const json data =
      f.scene.is_tree ? json() : animation_data(f);  // the moving picture knows hubs with hinged booms only
  std::string h = fmt::format(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>flexboom: "
      "{0}</title>{1}</head><body>\n<h1>{0}</h1>\n",
      escaped(f.scene.name), style);
  h += status_line(s);
  h += fmt::format("<p>{} s simulated in {} s ({} times real time), {} steps, {} contacts and releases.</p>\n",
                   cell(s.at("simulated_seconds")), cell(s.at("seconds").at("integrate")),
                   cell(s.at("real_time_factor")), cell(s.at("steps")), cell(s.at("events")));
  if (!f.scene.is_tree)
    h += fmt::format(
        "<canvas id=\"view\" width=\"820\" height=\"420\"></canvas><p>Drawn larger than it is: hub rotation {} times, "
        "boom deflection {} times. Click to stop or go on.</p>\n",
        cell(data.at("rotation")), cell(data.at("deflection")));
  for (const Plot& p : plots(f)) h += svg(p);
  h += "<h2>How wrong is it?</h2>\n<table>" + rows(s.at("error_budget")) +
       fmt::format("<tr><th>energy balance</th><td>{}</td></tr><tr><th>momentum drift</th><td>{}</td></tr></table>\n",
                   cell(s.at("energy_balance")), cell(s.at("momentum_drift")));
  h += "<h2>What was flown</h2>\n" + bodies_table(s.at("bodies")) + "<ul>\n";
  for (const json& line : s.at("plan")) h += "<li>" + escaped(line.get<std::string>()) + "</li>\n";
  for (const json& line : s.at("warnings")) h += "<li><b>warning:</b> " + escaped(line.get<std::string>()) + "</li>\n";
  h += "</ul><h2>The run</h2><table>" + rows(s) + rows(s.at("seconds"), "wall seconds: ") + "</table>\n";
  if (f.scene.is_tree) return h + "</body></html>\n";
  return h + "<script>const D=" + data.dump() + ";</script>" + player + "</body></html>\n";
}

}  // namespace

std::string report_html(const fs::path& folder) {
  const Folder f = read_folder(folder);
  try {
    return page(f);
  } catch (const json::exception& e) {
    throw InputError(fmt::format("{}: {}", (folder / "summary.json").string(), e.what()));
  }
}

std::string overview_svg(const fs::path& folder) {
  const std::vector<Plot> all = plots(read_folder(folder));
  const int height = all.front().height;
  std::string s =
      fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\">\n",
                  all.front().width, height * static_cast<int>(all.size()));
  for (size_t i = 0; i < all.size(); ++i)
    s += fmt::format("<g transform=\"translate(0 {})\">{}</g>\n", static_cast<int>(i) * height, svg(all[i]));
  return s + "</svg>\n";
}

}  // namespace flexboom
