#include "fem/booms/solid_boom.hpp"
#include "fem/mesh/shape_functions.hpp"

#include "fem/booms/boom_plan.hpp"
#include "fem_testing.hpp"
#include "hexahedron_geometry.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::aluminium;
using testing::input_error;
using testing::Integrals;
using testing::integrals;
using testing::pi;
using testing::surface;
using testing::worst_jacobian;

const Material steel{210e9, 0.3, 7850};

BeamGeometry boom_of(const std::vector<BeamSegment>& segments) {
  BeamGeometry boom;
  boom.segments = segments;
  return boom;
}
BeamGeometry uniform(const SectionShape& shape, double length = 0.3) {
  return boom_of({{shape, shape, length, aluminium, 0}});
}
BeamSegment piece(const SectionShape& start, const SectionShape& end, double length) {
  return {start, end, length, aluminium, 0};
}

SolidOptions of_order(int order, int sectors = 1) {
  SolidOptions options;
  options.order = order;
  options.grading = {sectors, 1, 3, 1, 1, 3, 2, 0.15};
  return options;
}

// Smallest distance of two nodes.
double closest_nodes(const Mesh& mesh) {
  std::vector<Index> by_x(static_cast<size_t>(mesh.nodes.cols()));
  for (size_t i = 0; i < by_x.size(); ++i) by_x[i] = static_cast<Index>(i);
  std::sort(by_x.begin(), by_x.end(), [&](Index a, Index b) {
    return std::lexicographical_compare(mesh.nodes.col(a).begin(), mesh.nodes.col(a).end(), mesh.nodes.col(b).begin(),
                                        mesh.nodes.col(b).end());
  });
  double least = 1e300;
  for (size_t i = 0; i < by_x.size(); ++i) {
    for (size_t j = i + 1; j < by_x.size() && mesh.nodes(0, by_x[j]) - mesh.nodes(0, by_x[i]) < 1e-9; ++j) {
      least = std::min(least, (mesh.nodes.col(by_x[i]) - mesh.nodes.col(by_x[j])).norm());
    }
  }
  return least;
}

::testing::AssertionResult says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos ? ::testing::AssertionSuccess() : ::testing::AssertionFailure() << text;
}

double frustum(double d1, double d2, double length) { return pi * length / 12 * (d1 * d1 + d1 * d2 + d2 * d2); }

// Outlines of polynomials enclose the area of their circle for every order; the shape of the outline, and with it the
// second moment, is as good as interpolation by that order.
TEST(SolidBoom, RoundSectionsHaveTheirAreaForEveryOrder) {
  // Of the second moment, quarters in one element; measured by an independent quadrature, 7 and 8 with round-off.
  static constexpr std::array<double, 9> moment_error = {0, 5e-2, 1e-4, 2e-5, 2e-7, 6e-9, 1e-11, 1e-12, 1e-12};
  const auto check = [](const SectionShape& shape, double slit, int sectors) {
    const Section exact = section_of(shape, 0.3, {});
    const auto* tube = std::get_if<Tube>(&shape);
    const double left = slit > 0 ? 1 - slit / (pi * (tube->diameter - tube->thickness)) : 1;
    for (int p = 1; p <= 8; ++p) {
      SolidOptions options = of_order(p, sectors);
      options.slit = slit;
      const Integrals sum = integrals(make_solid_mesh(uniform(shape), options));
      EXPECT_NEAR(sum.volume / (left * exact.A * 0.3), 1, 1e-12) << "order " << p << ", sectors " << sectors;
      if (slit > 0) continue;
      EXPECT_NEAR(sum.yy / (exact.Iz * 0.3), 1, moment_error[static_cast<size_t>(p)]) << "order " << p;
      EXPECT_NEAR(sum.zz / (exact.Iy * 0.3), 1, moment_error[static_cast<size_t>(p)]) << "order " << p;
      EXPECT_NEAR(sum.yz / (exact.Iz * 0.3), 0, 1e-12) << "order " << p;
    }
  };
  for (const int sectors : {1, 2, 3}) {
    check(RoundBar{0.01}, 0, sectors);
    check(Tube{0.03, 0.001}, 0, sectors);
    check(Tube{0.03, 0.001}, 0.002, sectors);
  }
}

TEST(SolidBoom, EverySectionHasItsConstants) {
  const std::vector<SectionShape> shapes = {RoundBar{0.02}, Tube{0.03, 0.001}, Rectangle{0.01, 0.03},
                                            RectangularTube{0.02, 0.05, 0.002}};
  for (const SectionShape& shape : shapes) {
    for (const int levels : {0, 1}) {
      SolidOptions options = of_order(6, 2);
      options.grading.corner_levels = levels;
      const Section exact = section_of(shape, 0.3, {});
      const Integrals sum = integrals(make_solid_mesh(uniform(shape), options));
      // Eighths of a circle of degree 6: 1e-14; with round-off of 1e4 points.
      EXPECT_NEAR(sum.volume / (0.3 * exact.A), 1, 1e-12) << shape.index();
      EXPECT_NEAR(sum.yy / (0.3 * exact.Iz), 1, 1e-12) << shape.index();
      EXPECT_NEAR(sum.zz / (0.3 * exact.Iy), 1, 1e-12) << shape.index();
    }
  }
}

// Cuts toward edges divide sides and walls; the body stays what it is.
TEST(SolidBoom, CutsTowardEdgesKeepTheBody) {
  const auto check = [](const SectionShape& section, double slit) {
    Index before = 0;
    double volume = 0;
    for (const int levels : {0, 1, 2, 3}) {
      SolidOptions options = of_order(3, 1);
      options.slit = slit;
      options.grading.edge_levels = levels;
      const Mesh mesh = make_solid_mesh(uniform(section), options);
      EXPECT_NO_THROW(mesh.validate());
      EXPECT_GT(mesh.nodes.cols(), before) << levels;
      before = mesh.nodes.cols();
      const double v = integrals(mesh).volume;
      if (volume == 0) volume = v;
      EXPECT_NEAR(v / volume, 1, 1e-12) << levels;
    }
  };
  check(RectangularTube{0.03, 0.02, 0.0015}, 0);
  check(RectangularTube{0.03, 0.03, 0.012}, 0);
  check(Rectangle{0.001, 0.02}, 0);
  check(Tube{0.02, 0.0005}, 0.001);
  SolidOptions options = of_order(3, 1);
  const Index none = make_solid_mesh(uniform(RoundBar{0.01}), options).nodes.cols();
  options.grading.edge_levels = 3;
  EXPECT_EQ(make_solid_mesh(uniform(RoundBar{0.01}), options).nodes.cols(), none);  // it has no edges
}

TEST(SolidBoom, SlitTubeLosesItsSlit) {
  SolidOptions options = of_order(6, 2);
  options.slit = 0.004;
  const double d = 0.03, t = 0.001, left = 1 - 0.004 / (pi * (d - t));
  const Mesh mesh = make_solid_mesh(uniform(Tube{d, t}), options);
  EXPECT_NEAR(integrals(mesh).volume, left * section_of(Tube{d, t}, 0.3, {}).A * 0.3, 1e-12 * pi * d * t * 0.3);
  // Lateral surfaces, two annuli, two faces of the slit.
  const double expected = left * (pi * 0.3 * (d + d - 2 * t) + 2 * pi * (d - t) * t) + 2 * t * 0.3;
  EXPECT_NEAR(surface(mesh) / expected, 1, 1e-11);
}

// Name, boom, volume, surface (0: not a simple formula).
struct Case {
  const char* name;
  BeamGeometry boom;
  double volume = 0;
  double surface = 0;
};
std::vector<Case> cases() {
  const double L = 0.1;
  const auto side = [&](double d) { return pi * d * L; };
  const auto disc = [](double d) { return pi * d * d / 4; };
  const RoundBar wide{0.010}, middle{0.006}, thin{0.004};
  BeamGeometry with_tip = uniform(wide, L);
  with_tip.attachments.push_back({"camera", L, 0.1, Matrix3d::Zero(), Vector3d::Zero()});
  return {
      {"bar", uniform(wide, L), disc(0.01) * L, side(0.01) + 2 * disc(0.01)},
      {"bar with a body at the tip", with_tip, disc(0.01) * L, side(0.01) + 2 * disc(0.01)},
      {"tapered bar", boom_of({piece(wide, thin, L)}), frustum(0.01, 0.004, L), 0},
      {"tapered tube", boom_of({piece(Tube{0.03, 0.002}, Tube{0.02, 0.001}, L)}),
       frustum(0.03, 0.02, L) - frustum(0.026, 0.018, L), 0},
      {"rectangle", uniform(Rectangle{0.004, 0.02}, L), 8e-5 * L, 2 * 8e-5 + 0.048 * L},
      {"step down", boom_of({piece(wide, wide, L), piece(thin, thin, L)}), (disc(0.01) + disc(0.004)) * L,
       side(0.01) + side(0.004) + 2 * disc(0.01)},
      {"stairs down", boom_of({piece(wide, wide, L), piece(middle, middle, L), piece(thin, thin, L)}),
       (disc(0.01) + disc(0.006) + disc(0.004)) * L, side(0.01) + side(0.006) + side(0.004) + 2 * disc(0.01)},
      {"waist", boom_of({piece(middle, middle, L), piece(thin, thin, L), piece(wide, wide, L)}),
       (disc(0.01) + disc(0.006) + disc(0.004)) * L,
       side(0.01) + side(0.006) + side(0.004) + 2 * disc(0.006) - 2 * disc(0.004) + 2 * disc(0.01)},
      {"up two steps, down one",
       boom_of({piece(thin, thin, L), piece(middle, middle, L), piece(wide, wide, L), piece(middle, middle, L)}),
       (disc(0.004) + 2 * disc(0.006) + disc(0.01)) * L, side(0.004) + 2 * side(0.006) + side(0.01) + 2 * disc(0.01)},
      {"taper, then steps", boom_of({piece(wide, middle, L), piece(middle, middle, L), piece(thin, thin, L)}),
       frustum(0.01, 0.006, L) + (disc(0.006) + disc(0.004)) * L, 0},
  };
}

TEST(SolidBoom, ElementsArePositiveForEveryOrderAndShape) {
  for (const Case& c : cases()) {
    for (int p = 1; p <= 8; ++p) {
      // The worst place is a trapezoid of a tapered ring: small side over large side of 0.15, corner at a core.
      EXPECT_GT(worst_jacobian(make_solid_mesh(c.boom, of_order(p, p < 3 ? 2 : 1))), 0.02) << c.name << " order " << p;
    }
  }
}

TEST(SolidBoom, VolumesAndSurfacesCloseOverStepsAndTapers) {
  for (const Case& c : cases()) {
    const Mesh mesh = make_solid_mesh(c.boom, of_order(6));
    EXPECT_NEAR(integrals(mesh).volume / c.volume, 1, 4e-9) << c.name;  // error of a quarter circle of degree 6
    const double area = surface(mesh);
    if (c.surface == 0) continue;
    EXPECT_NEAR(area / c.surface, 1, 1e-7) << c.name;  // the error of slopes, larger than that of places
  }
}

TEST(SolidBoom, NoTwoNodesCoincideAndNoneIsUnused) {
  for (const Case& c : cases()) {
    const Mesh mesh = make_solid_mesh(c.boom, of_order(4));
    if (c.boom.attachments.empty()) {  // a reference node may lie on a node of the section
      EXPECT_GT(closest_nodes(mesh), 1e-6) << c.name;
    }
    std::set<int> used;
    for (const Element& element : mesh.elements) used.insert(element.nodes.begin(), element.nodes.end());
    for (const NodalBody& body : mesh.bodies) used.insert(body.node);
    EXPECT_EQ(static_cast<Index>(used.size()), mesh.nodes.cols()) << c.name;
  }
}

TEST(SolidBoom, NodeSetsAreComplete) {
  const double R = 0.005, L = 0.302;
  const Mesh mesh = make_solid_mesh(uniform(RoundBar{2 * R}, L), of_order(4));
  std::map<std::string, std::vector<int>> expected;
  for (Index i = 0; i < mesh.nodes.cols(); ++i) {
    const double r = mesh.nodes.col(i).tail<2>().norm();
    if (mesh.nodes(0, i) == 0) expected["root"].push_back(static_cast<int>(i));
    if (mesh.nodes(0, i) == L) expected["tip"].push_back(static_cast<int>(i));
    if (mesh.nodes(0, i) == L && r < 1e-9) expected["tip_center"].push_back(static_cast<int>(i));
    if (r > R * (1 - 1e-12)) expected["side"].push_back(static_cast<int>(i));
  }
  EXPECT_EQ(mesh.node_sets, expected);
  // A face of order 4 has 25 nodes in the core and 4 x 4 x 4 around it; two refinements add 2 x 4 rows of 16.
  EXPECT_EQ(node_set(mesh, "tip").size(), 89u);
  EXPECT_EQ(node_set(mesh, "root").size(), 89u + 128u);
  EXPECT_FALSE(make_solid_mesh(uniform(RoundBar{2 * R}, L), of_order(5)).node_sets.contains("tip_center"));
}

TEST(SolidBoom, RimOfTheClampIsRefinedAndNothingElse) {
  const Mesh coarse = make_solid_mesh(uniform(RoundBar{0.01}), of_order(4));
  SolidOptions options = of_order(4);
  options.grading.corner_levels = 4;
  const Mesh fine = make_solid_mesh(uniform(RoundBar{0.01}), options);
  EXPECT_EQ(fine.elements.size(), coarse.elements.size() + 16u);  // 2 levels, 2 trapezoids, 4 sectors
  double nearest = 1;
  for (Index i = 0; i < fine.nodes.cols(); ++i) {
    const double x = fine.nodes(0, i);
    if (x > 0) nearest = std::min(nearest, x);
  }
  // First layer 0.005, four refinements of 0.15, first Lobatto step of order 4.
  const double step = (1 + lobatto_basis(4).nodes()(1)) / 2;
  EXPECT_NEAR(nearest / (0.005 * std::pow(0.15, 4) * step), 1, 1e-9);
}

TEST(SolidBoom, SegmentsAndMaterialsAreKept) {
  const RoundBar bar{0.01};
  const Mesh mesh = make_solid_mesh(
      boom_of({{bar, bar, 0.1, aluminium, 0}, {bar, bar, 0.1, steel, 0}, {bar, bar, 0.1, aluminium, 0}}), of_order(3));
  ASSERT_EQ(mesh.solid_properties.size(), 2u);
  EXPECT_EQ(mesh.solid_properties[1].material.rho, steel.rho);
  size_t total = 0;
  for (int s = 0; s < 3; ++s) {
    for (const int e : mesh.element_sets.at("segment_" + std::to_string(s + 1))) {
      const Element& element = mesh.elements[static_cast<size_t>(e)];
      EXPECT_EQ(element.property, s % 2);
      for (const int node : element.nodes) {
        EXPECT_GE(mesh.nodes(0, node), 0.1 * s - 1e-12);
        EXPECT_LE(mesh.nodes(0, node), 0.1 * (s + 1) + 1e-12);
      }
      ++total;
    }
  }
  EXPECT_EQ(total, mesh.elements.size());
}

TEST(SolidBoom, AttachmentsRideOnSectionsAndAreBoltedToTheTip) {
  BeamGeometry boom = uniform(RoundBar{0.01});
  const Vector3d offset(0, 0.01, 0);
  boom.attachments = {{"camera", 0.3, 0.2, 1e-4 * Matrix3d::Identity(), offset},
                      {"lamp", 0.3, 0.1, Matrix3d::Zero(), Vector3d::Zero()},
                      {"sensor", 0.123, 0.05, Matrix3d::Zero(), Vector3d::Zero()}};
  const Mesh mesh = make_solid_mesh(boom, of_order(4));
  ASSERT_EQ(mesh.bodies.size(), 3u);
  EXPECT_EQ(mesh.bodies[0].node, mesh.bodies[1].node);
  EXPECT_EQ(mesh.bodies[0].offset, offset);
  ASSERT_EQ(mesh.rigid_connections.size(), 1u);
  EXPECT_EQ(mesh.rigid_connections[0].nodes, node_set(mesh, "tip"));
  EXPECT_EQ(mesh.rigid_connections[0].reference, node_set(mesh, "camera")[0]);
  ASSERT_EQ(mesh.distributing_connections.size(), 1u);
  const DistributingConnection& ring = mesh.distributing_connections[0];
  EXPECT_EQ(ring.reference, node_set(mesh, "sensor")[0]);
  EXPECT_EQ(ring.nodes.size(), 89u);
  // Weights are shares of the section: they sum up to it and have its second moment (Gauss-Lobatto, degree 2 p - 1).
  double sum = 0, moment = 0;
  for (size_t i = 0; i < ring.nodes.size(); ++i) {
    const Vector3d x = mesh.nodes.col(ring.nodes[i]);
    EXPECT_DOUBLE_EQ(x.x(), 0.123);
    EXPECT_GT(ring.weights[i], 0);
    sum += ring.weights[i];
    moment += ring.weights[i] * x.y() * x.y();
  }
  EXPECT_NEAR(sum / (pi * 0.25e-4), 1, 1e-3);
  EXPECT_NEAR(moment / (pi * std::pow(0.01, 4) / 64), 1, 1e-3);
}

TEST(SolidBoom, EveryKindOfElementConforms) {
  for (const char* kind : {"hex8", "hex8-reduced", "hex20", "hex20-reduced", "hex27", "tet4", "tet10"}) {
    SolidOptions options = of_order(0, 3);
    options.element = kind;
    if (options.element.starts_with("tet")) options.grading.corner_levels = 0;
    const Mesh mesh = make_solid_mesh(uniform(RoundBar{0.01}, 0.05), options);
    const bool tetrahedra = std::string(kind).starts_with("tet");
    std::map<std::set<int>, int> count;
    double volume = 0;
    for (const Element& element : mesh.elements) {
      EXPECT_EQ(type_of(element).name, kind);
      const auto at = [&](size_t i) { return Vector3d(mesh.nodes.col(element.nodes[i])); };
      const Vector3d a = at(1) - at(0), b = at(tetrahedra ? 2 : 3) - at(0), c = at(tetrahedra ? 3 : 4) - at(0);
      EXPECT_GT(a.cross(b).dot(c), 0);
      if (!tetrahedra) continue;
      volume += a.cross(b).dot(c) / 6;
      for (size_t skip = 0; skip < 4; ++skip) {
        std::set<int> face(element.nodes.begin(), element.nodes.begin() + 4);
        face.erase(element.nodes[skip]);
        ++count[face];
      }
      for (size_t e = 4; e < element.nodes.size(); ++e) {  // on curved faces the middle is off the chord
        constexpr std::array<std::array<size_t, 2>, 6> edges = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
        const auto [i, j] = edges[e - 4];
        EXPECT_LT((at(e) - (at(i) + at(j)) / 2).norm(), 0.25 * (at(i) - at(j)).norm());
      }
    }
    double surface = 0;  // of faces that belong to one element: cuts that do not meet would add to it
    for (const auto& [face, times] : count) {
      EXPECT_LE(times, 2);
      const std::vector<int> corner(face.begin(), face.end());
      const Vector3d a = mesh.nodes.col(corner[1]) - mesh.nodes.col(corner[0]);
      const Vector3d b = mesh.nodes.col(corner[2]) - mesh.nodes.col(corner[0]);
      if (times == 1) surface += a.cross(b).norm() / 2;
    }
    if (tetrahedra) {
      EXPECT_NEAR(surface / (pi * (0.01 * 0.05 + 0.5e-4)), 1, 0.05) << kind;
      EXPECT_NEAR(volume / (pi * 0.25e-4 * 0.05), 1, 0.05) << kind;  // twelve-sided prism: 0.955
    }
    EXPECT_NO_THROW(mesh.validate()) << kind;
  }
}

TEST(SolidBoom, AccuracyChoosesTheRestAndKeepsWhatIsGiven) {
  const BeamGeometry boom = uniform(RoundBar{0.01}, 0.302);
  Index before = 0;
  for (const double accuracy : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7}) {
    SolidOptions options;
    options.accuracy = accuracy;
    const Index nodes = make_solid_mesh(boom, options).nodes.cols();
    EXPECT_GT(nodes, before);
    before = nodes;
  }
  SolidOptions options;
  options.order = 7;
  options.grading.long_elements = 2;
  options.grading.corner_levels = 0;
  const SolidOptions result = chosen(boom, options);
  EXPECT_EQ(result.order, 7);
  EXPECT_EQ(result.grading.long_elements, 2);
  EXPECT_EQ(result.grading.corner_levels, 0);
  EXPECT_GT(result.grading.factor, 0);
  // The fifth pair of bending modes comes before the first extension in a slender boom.
  EXPECT_GT(chosen(uniform(RoundBar{0.01}, 0.6), {}).grading.long_elements, chosen(boom, {}).grading.long_elements);
}

TEST(SolidBoom, ARefinedMeshHasAHigherOrderAndFinerRims) {
  const BeamGeometry boom = uniform(RoundBar{0.01}, 0.302);
  SolidOptions wanted;
  wanted.accuracy = 1e-3;
  const SolidOptions start = chosen(boom, wanted);
  ASSERT_EQ(start.order, 3);
  for (const int steps : {-1, 1, 5}) {
    const SolidOptions other = refined(start, steps).value();
    EXPECT_EQ(other.order, start.order + steps);
    EXPECT_EQ(other.grading.corner_levels, std::max(1, start.grading.corner_levels + steps));  // one is kept
    EXPECT_EQ(other.grading.long_elements, start.grading.long_elements);
  }
  EXPECT_FALSE(refined(start, -3));
  const SolidOptions halved = refined(start, 6).value();  // there is no order 9
  EXPECT_EQ(halved.order, 8);
  EXPECT_EQ(halved.grading.long_elements, 2 * start.grading.long_elements);
  EXPECT_EQ(halved.grading.sectors, 2 * start.grading.sectors);
  SolidOptions given;
  given.element = "hex20";
  const SolidOptions serendipity = chosen(boom, given);
  EXPECT_FALSE(refined(serendipity, -1));
  EXPECT_EQ(refined(serendipity, 1)->element, "hex");
  EXPECT_EQ(refined(serendipity, 1)->order, 3);
}

TEST(SolidBoom, BadInputIsNamed) {
  const BeamGeometry boom = uniform(RoundBar{0.01});
  const auto error = [&](const std::function<void(SolidOptions&)>& change) {
    SolidOptions options;
    change(options);
    return input_error([&] { make_solid_mesh(boom, options); });
  };
  EXPECT_EQ(error([](SolidOptions& o) { o.order = 9; }), "order is 9; it must be 0 to 8");
  EXPECT_EQ(error([](SolidOptions& o) { o.grading.factor = -0.1; }),
            "grading: factor is -0.1; it must lie between 0 and 1");
  EXPECT_EQ(error([](SolidOptions& o) { o.grading.growth = 1; }), "grading: growth is 1; it must be above 1");
  EXPECT_EQ(error([](SolidOptions& o) { o.grading.first_layer = std::nan(""); }),
            "grading: first_layer is nan; it must be positive");
  EXPECT_EQ(error([](SolidOptions& o) { o.grading.sectors = -1; }), "grading: sectors is -1; it must be 0 to 100000");
  for (const char* value : {"0", "1e-20", "1"})
    EXPECT_EQ(error([value](SolidOptions& o) { o.accuracy = std::stod(value); }),
              std::string("accuracy is ") + value +
                  "; it must be 1e-08 or more, the best that is known of a mesh, and less than 1");
  EXPECT_EQ(error([](SolidOptions& o) { o.slit = 0.001; }),
            "slit: only tubes can be slit; this boom has another section");
  EXPECT_EQ(error([](SolidOptions& o) { o.element = "tet10", o.grading.corner_levels = 2; }),
            "grading: corner_levels is 2; it is for hexahedra, leave it out for \"tet10\"");
  EXPECT_TRUE(says(error([](SolidOptions& o) { o.element = "hex9"; }), "\"hex9\" is not known"));
  EXPECT_TRUE(says(error([](SolidOptions& o) { o.element = "hex20", o.order = 3; }), "\"hex20\" has order 2"));
}

TEST(SolidBoom, BadGeometryIsNamed) {
  const auto error = [](const BeamGeometry& boom) { return input_error([&] { make_solid_mesh(boom); }); };
  EXPECT_TRUE(says(error(uniform(Tube{0.01, 0.006})), "more than half the diameter"));
  EXPECT_TRUE(says(error(uniform(Tube{0.01, 0.005})), "leaves no hole"));
  EXPECT_TRUE(says(error(uniform(GeneralSection{1e-4, 1e-9, 1e-9, 1e-9, 1, 1})),
                   "segments[0]: a general section has no outline"));
  EXPECT_TRUE(says(error(boom_of({piece(RoundBar{0.01}, RoundBar{0.01}, 0.1),
                                  piece(Rectangle{0.01, 0.01}, Rectangle{0.01, 0.01}, 0.1)})),
                   "segments[1]: its section differs from the end of segments[0]"));
  BeamGeometry taken = uniform(RoundBar{0.01});
  taken.attachments.push_back({"side", 0.3, 1, Matrix3d::Zero(), Vector3d::Zero()});
  EXPECT_TRUE(says(error(taken), "\"side\""));
}

}  // namespace
}  // namespace flexboom
