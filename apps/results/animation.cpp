#include "apps/results/animation.hpp"

#include "apps/base/deflection.hpp"
#include "apps/simulate/tree_flight.hpp"
#include "dynamics/numerics/rotation.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace flexboom {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

/// States of the tree from the columns that were made of them, without rates.
class Rows {
 public:
  Rows(const Scene& scene, const Tree& tree, const OutputTable& table) : scene_(scene), tree_(tree), table_(table) {
    for (size_t i = 0; i < table.names.size(); ++i) columns_[table.names[i]] = static_cast<Index>(i);
  }

  Index count() const { return table_.values.rows(); }

  double value(Index row, const std::string& column) const {
    const auto found = columns_.find(column);
    require(found != columns_.end(), fmt::format("trajectory.csv has no column '{}'", column));
    return table_.values(row, found->second);
  }

  TreeState state(Index row) const {
    TreeState s = tree_.at_rest();
    const auto vector = [&](const std::string& stem) {
      return Vector3d(value(row, stem + ".x"), value(row, stem + ".y"), value(row, stem + ".z"));
    };
    for (size_t i = 0; i < scene_.joints.size(); ++i) {
      const JointScene& j = scene_.joints[i];
      const ScalarOutputs scalars = scalar_outputs(j.kind);
      for (size_t k = 0; k < scalars.values.size(); ++k)
        s.joints[i].coordinate[k] = value(row, fmt::format("{}{}", j.name, scalars.values[k]));
      if (joint_type(j.kind).turns) s.joints[i].attitude = quaternion_of(vector(j.name + ".rotation"));
      if (joint_type(j.kind).floats) s.joints[i].position = vector(j.name + ".position");
    }
    for (size_t b = 0; b < s.q.size(); ++b)
      for (Index k = 0; k < s.q[b].size(); ++k)
        s.q[b][k] = value(row, fmt::format("{}.q{}", scene_.bodies[b].name, k + 1));
    return s;
  }

 private:
  const Scene& scene_;
  const Tree& tree_;
  const OutputTable& table_;
  std::map<std::string, Index> columns_;
};

/// Text of a script's array; six digits are enough for a picture.
class Array {
 public:
  template <class Numbers>
  void add(const Numbers& numbers) {
    for (const double v : numbers) add(v);
  }
  /// Below a picometre is round-off.
  void add(double v) {
    fmt::format_to(std::back_inserter(text_), "{}{:.6g}", separator(), std::abs(v) < 1e-12 ? 0.0 : v);
  }
  void add(const std::string& text) { fmt::format_to(std::back_inserter(text_), "{}{}", separator(), text); }
  std::string text() const { return "[" + fmt::to_string(text_) + "]"; }

 private:
  const char* separator() const { return text_.size() > 0 ? "," : ""; }
  fmt::memory_buffer text_;
};

/// Lines over points, of surfaces the edges of at most so many triangles.
std::vector<std::vector<int>> lines_of(const DisplayShape& shape) {
  constexpr size_t enough = 800;
  if (!shape.lines.empty()) return shape.lines;
  std::vector<std::vector<int>> lines;
  const size_t stride = shape.triangles.size() / enough + 1;
  for (size_t i = 0; i < shape.triangles.size(); i += stride) {
    const auto& [a, b, c] = shape.triangles[i];
    lines.push_back({a, b, c, a});
  }
  return lines;
}

/// Name, points in the BRF, shapes point by point for each coordinate, lines over the points that they use.
std::string body_data(const ReducedBody& body) {
  const DisplayShape& shape = body.display;
  Array points, lines;
  std::vector<Array> shapes(static_cast<size_t>(body.n()));
  std::map<int, int> used;
  for (const std::vector<int>& line : lines_of(shape)) {
    Array numbers;
    for (const int point : line) {
      const auto [place, is_new] = used.try_emplace(point, static_cast<int>(used.size()));
      numbers.add(static_cast<double>(place->second));
      if (!is_new) continue;
      points.add(Vector3d(shape.points.col(point)));
      for (Index k = 0; k < body.n(); ++k)
        shapes[static_cast<size_t>(k)].add(Vector3d(shape.S[static_cast<size_t>(point)].col(k)));
    }
    lines.add(numbers.text());
  }
  Array all;
  for (const Array& s : shapes) all.add(s.text());
  return fmt::format("{{name:\"{}\",points:{},shapes:{},lines:{}}}", body.name, points.text(), all.text(),
                     lines.text());
}

/// The frames, and what is learned on the way.
class Film {
 public:
  Film(const Scene& scene, const Tree& tree)
      : tree_(tree), floats_(std::ranges::any_of(scene.joints, [](const JointScene& j) {
          return j.kind == JointKind::free && j.a.body.empty();
        })) {
    for (const ReducedBody& b : tree.scene().bodies) deflection_.emplace_back(b), mass_ += b.m;
  }

  /// Per body its place, its attitude as three columns, its coordinates.
  void add(double t, const TreeState& s) {
    const Eigen::VectorXd y = tree_.pack(s);
    std::vector<PlaceMotionInSpace> brf;
    Vector3d centre = Vector3d::Zero();
    for (size_t b = 0; b < deflection_.size(); ++b) {
      brf.push_back(tree_.motion(t, y, Place{.body = static_cast<int>(b), .marker = {}}));
      const ReducedBody& body = tree_.scene().bodies[b];
      centre += (body.m * brf[b].position + brf[b].axes * body.mc0) / mass_;
      exaggeration_ = std::min(exaggeration_, 0.1 * deflection_[b].length() / deflection_[b].largest(s.q[b]));
    }
    Array frame;
    frame.add(t);
    for (size_t b = 0; b < brf.size(); ++b) {
      if (floats_) brf[b].position -= centre;
      frame.add(brf[b].position);
      frame.add(brf[b].axes.reshaped());
      frame.add(s.q[b]);
      const Matrix3Xd corners = tree_.scene().bodies[b].display.points;
      for (Index i = 0; i < corners.cols(); ++i) grow(brf[b].position + brf[b].axes * corners.col(i));
    }
    frames_.add(frame.text());
  }

  /// By how much deflections are drawn larger than they are: 1, 10, 100...
  double exaggeration() const {
    return std::isfinite(exaggeration_) ? std::max(1.0, std::pow(10, std::floor(std::log10(exaggeration_)))) : 1;
  }
  std::string frames() const { return frames_.text(); }
  Vector3d middle() const { return (low_ + high_) / 2; }
  double size() const { return std::max((high_ - low_).norm(), 1e-30); }

 private:
  void grow(const Vector3d& p) { low_ = low_.cwiseMin(p), high_ = high_.cwiseMax(p); }

  const Tree& tree_;
  bool floats_;
  double mass_ = 0, exaggeration_ = std::numeric_limits<double>::infinity();
  std::vector<Deflection> deflection_;
  Vector3d low_ = Vector3d::Constant(std::numeric_limits<double>::infinity()), high_ = -low_;
  Array frames_;
};

// Orthographic; x to the right and to the reader, z up, until it is turned.
constexpr const char* player = R"(<script>{
const c=document.getElementById('view'),g=c.getContext('2d'),s=document.getElementById('time');
const colours=['#0072b2','#d55e00','#009e73','#cc79a7','#e69f00','#56b4e9','#444','#8c564b','#17becf','#7f7f7f'];
let n=0,run=true,az=.6,el=.4,zoom=1,held=null;
const view=v=>{const [x,y,z]=v.map((a,i)=>a-D.middle[i]),k=1.4*Math.min(c.width,c.height)/D.size*zoom;
 return[c.width/2+k*(Math.cos(az)*y-Math.sin(az)*x),c.height/2-k*(Math.cos(el)*z-Math.sin(el)*(Math.cos(az)*x+Math.sin(az)*y))];};
function draw(){const f=D.frames[n];let at=1;g.clearRect(0,0,c.width,c.height);
 D.bodies.forEach((b,i)=>{const o=at,m=b.shapes.length;at+=12+m;
  const point=p=>{const x=[0,1,2].map(j=>{let v=b.points[3*p+j];for(let k=0;k<m;k++)v+=D.exaggeration*f[o+12+k]*b.shapes[k][3*p+j];return v;});
   return view([0,1,2].map(r=>f[o+r]+f[o+3+r]*x[0]+f[o+6+r]*x[1]+f[o+9+r]*x[2]));};
  const P=Array.from({length:b.points.length/3},(_,p)=>point(p));
  g.beginPath();for(const l of b.lines)l.forEach((p,k)=>k?g.lineTo(...P[p]):g.moveTo(...P[p]));
  g.strokeStyle=colours[i%10];g.lineWidth=b.lines.length>20?.7:2;g.stroke();
  g.fillStyle=colours[i%10];g.font='13px sans-serif';g.fillText(b.name,12+130*(i%6),c.height-12-16*Math.floor(i/6));});
 g.fillStyle='#222';g.fillText('t = '+f[0].toPrecision(5)+' s',12,20);s.value=n;
 if(run&&!held)n=(n+1)%D.frames.length;requestAnimationFrame(draw);}
s.max=D.frames.length-1;s.oninput=()=>{n=+s.value;run=false;};
c.onpointerdown=e=>{held=[e.clientX,e.clientY,az,el,false];c.setPointerCapture(e.pointerId);};
c.onpointermove=e=>{if(!held)return;const dx=e.clientX-held[0],dy=e.clientY-held[1];held[4]||=Math.hypot(dx,dy)>3;
 if(held[4]){az=held[2]-dx/150;el=Math.max(-1.57,Math.min(1.57,held[3]+dy/150));}};
c.onpointerup=()=>{if(held&&!held[4])run=!run;held=null;};
c.onwheel=e=>{e.preventDefault();zoom*=Math.exp(-e.deltaY/500);};draw();}</script>)";

}  // namespace

std::string animation_html(const Scene& given, const OutputTable& table, const std::filesystem::path& kept) {
  constexpr Index most_frames = 600;
  const Scene scene = without_loops(with_joints(given));
  std::vector<PreparedBody> bodies;
  for (const BodyScene& b : scene.bodies) bodies.push_back(prepare_body(b, 0, kept));
  const Tree tree(make_multibody(scene, bodies));
  const Rows rows(scene, tree, table);
  Film film(scene, tree);
  for (Index row = 0; row < rows.count(); row += std::max<Index>(1, rows.count() / most_frames))
    film.add(rows.value(row, "t"), rows.state(row));
  Array drawn, middle;
  for (const PreparedBody& p : bodies) drawn.add(body_data(p.body));
  middle.add(film.middle());
  const std::string words =
      film.exaggeration() > 1 ? fmt::format("Deflections are drawn {:g} times larger. ", film.exaggeration()) : "";
  return fmt::format(
             "<canvas id=\"view\" width=\"820\" height=\"460\"></canvas><input id=\"time\" type=\"range\" min=\"0\" "
             "value=\"0\"><p>{}Drag to turn, wheel to zoom, click to stop or go on.</p>\n<script>const "
             "D={{bodies:{},frames:{},middle:{},size:{:.6g},exaggeration:{:g}}};</script>",
             words, drawn.text(), film.frames(), middle.text(), film.size(), film.exaggeration()) +
         player;
}

}  // namespace flexboom
