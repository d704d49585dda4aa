#include "fem/booms/solid_boom.hpp"
#include "fem_testing.hpp"

#include <fmt/format.h>

namespace flexboom::testing {
namespace {

BeamGeometry two_segments() {
  BeamGeometry boom = uniform_boom(RoundBar{0.01}, 0.1, BeamTheory::timoshenko, 0, 4);
  boom.segments.push_back({RoundBar{0.01}, RoundBar{0.005}, 0.3, aluminium, 0});
  return boom;
}

RigidAttachment sensor(double position) {
  return {"sensor", position, 0.1, Eigen::Vector3d(1e-5, 2e-5, 2e-5).asDiagonal(), {0, 0.01, 0}};
}

TEST(MakeMesh, PutsNodesAtSegmentEndsAndAttachments) {
  BeamGeometry boom = two_segments();
  boom.attachments = {sensor(0.25)};
  const Mesh mesh = make_mesh(boom);
  mesh.validate();
  const Eigen::VectorXd x = mesh.nodes.row(0);
  EXPECT_EQ(x(0), 0);
  EXPECT_EQ(x(x.size() - 1), boom.length());
  EXPECT_EQ((x.array() - 0.1).abs().minCoeff(), 0);
  EXPECT_EQ(x(mesh.bodies[0].node), 0.25);
  EXPECT_EQ(node_set(mesh, "sensor"), std::vector<int>{mesh.bodies[0].node});
  EXPECT_EQ(node_set(mesh, "tip"), std::vector<int>{static_cast<int>(x.size()) - 1});
  EXPECT_TRUE((x.tail(x.size() - 1) - x.head(x.size() - 1)).minCoeff() > 0);
}

TEST(MakeMesh, ChoosesAboutEightElements) {
  EXPECT_EQ(make_mesh(two_segments()).elements.size(), 8U);
  BeamGeometry many = two_segments();
  for (int i = 0; i < 20; ++i) many.segments.push_back(many.segments[0]);
  EXPECT_EQ(make_mesh(many).elements.size(), 21U + 1U);  // 0.3 m of 2.3 m is one element, like every other segment
  many = two_segments();
  many.segments[0].elements = 5;
  many.segments[1].elements = 2;
  EXPECT_EQ(make_mesh(many).elements.size(), 7U);
}

TEST(MakeMesh, TaperContinuesAcrossElements) {
  BeamGeometry boom = uniform_boom(RoundBar{0.01}, 0.4, BeamTheory::timoshenko, 4, 2);
  boom.segments[0].end = RoundBar{0.006};
  const Mesh mesh = make_mesh(boom);
  for (size_t e = 0; e < 4; ++e) {
    const auto& property = mesh.beam_properties[static_cast<size_t>(mesh.elements[e].property)];
    EXPECT_NEAR(std::get<RoundBar>(property.start).diameter, 0.01 - 0.001 * static_cast<double>(e), 1e-17);
    EXPECT_NEAR(std::get<RoundBar>(property.end).diameter, 0.009 - 0.001 * static_cast<double>(e), 1e-17);
  }
}

/// Positions that are computed elsewhere miss a joint by their last digits.
TEST(MakeMesh, StationsAreOneOrFarEnoughApart) {
  BeamGeometry boom = two_segments();
  const size_t plain = make_mesh(boom).elements.size();
  boom.attachments = {sensor(0.1 + 0.9 * same_station * 0.4), sensor(0.4 * (1 + 0.9 * same_station))};
  boom.attachments[1].name = "";
  const Mesh mesh = make_mesh(boom);
  EXPECT_EQ(mesh.elements.size(), plain);
  EXPECT_EQ(mesh.bodies[1].node, node_set(mesh, "tip")[0]);
  boom.attachments = {sensor(0.1 + 1.1 * shortest_beam * 0.4)};
  EXPECT_EQ(make_mesh(boom).elements.size(), plain + 1);
  for (const double gap : {1.1 * same_station, 0.9 * shortest_beam}) {
    for (const double position : {0.1 + gap * 0.4, 0.1 - gap * 0.4, gap * 0.4, (1 - gap) * 0.4}) {
      boom.attachments = {sensor(position)};
      const std::string message = input_error([&] { make_mesh(boom); });
      EXPECT_NE(message.find("at one place, or at least 4e-06 m apart"), std::string::npos) << message;
    }
  }
}

TEST(MakeMesh, AttachmentAtSegmentEndNeedsNoNewNode) {
  BeamGeometry boom = two_segments();
  const size_t plain = make_mesh(boom).elements.size();
  boom.attachments = {sensor(0.1 + 1e-17), sensor(0.4), sensor(0)};
  boom.attachments[1].name = boom.attachments[2].name = "";
  EXPECT_EQ(make_mesh(boom).elements.size(), plain);
}

std::string fault(const std::function<void(BeamGeometry&)>& spoil) {
  BeamGeometry boom = two_segments();
  boom.attachments = {sensor(0.2)};
  spoil(boom);
  return input_error([&] { boom.validate(); });
}

TEST(BeamGeometry, BadSegmentSaysWhatIsWrong) {
  using B = BeamGeometry;
  EXPECT_EQ(fault([](B& b) { b.segments.clear(); }), "segments: a boom needs at least one");
  EXPECT_EQ(fault([](B& b) { b.order = 13; }), "order is 13; it must be 1 to 12");
  EXPECT_EQ(fault([](B& b) { b.segments[1].length = -0.1; }), "segments[1]: length is -0.1 m; it must be positive");
  EXPECT_EQ(fault([](B& b) { b.segments[1].length = INFINITY; }), "segments[1]: length is inf m; it must be positive");
  EXPECT_EQ(fault([](B& b) { b.segments[0].elements = -1; }),
            "segments[0]: elements is -1; it must be 1 to 100000, or 0 to let the program choose");
  EXPECT_EQ(fault([](B& b) { b.segments[0].material.nu = 0.6; }),
            "segments[0]: material: nu is 0.6; it must lie between -1 and 0.5");
  EXPECT_EQ(fault([](B& b) { b.segments[0].end = RoundBar{0}; }),
            "segments[0]: end: round bar: diameter [m]: is 0; it must be positive");
  EXPECT_EQ(fault([](B& b) {
              b.segments[0].end = Tube{0.01, 0.001};
            }),
            "segments[0]: taper: the start and the end must be sections of one kind");
  EXPECT_EQ(fault([](B& b) {
              for (BeamSegment& s : b.segments) s.material.rho = 0;
              b.attachments.clear();
            }),
            "the boom has no mass: rho is zero in every segment and nothing with mass is attached");
}

TEST(BeamGeometry, BadAttachmentSaysWhatIsWrong) {
  using B = BeamGeometry;
  EXPECT_EQ(fault([](B& b) { b.attachments[0].position = 0.5; }),
            "attachments[0]: position is 0.5 m; the boom reaches from 0 to 0.4 m");
  EXPECT_EQ(fault([](B& b) { b.attachments[0].mass = -1; }),
            "attachments[0]: mass is -1 kg; it must be zero or positive");
  EXPECT_EQ(fault([](B& b) { b.attachments[0].mass = 0; }),
            "attachments[0]: inertia without mass; give the mass that carries it");
  EXPECT_EQ(fault([](B& b) { b.attachments[0].offset(1) = NAN; }),
            "attachments[0]: offset has a component that is not finite");
  EXPECT_EQ(fault([](B& b) { b.attachments[0].inertia(0, 1) = 1e-6; }), "attachments[0]: inertia must be symmetric");
  EXPECT_EQ(fault([](B& b) { b.attachments[0].inertia = Eigen::Vector3d(1, 1, 3).asDiagonal(); }),
            "attachments[0]: inertia breaks the triangle inequality: principal values 1, 1, 3 kg m^2; none can exceed "
            "the sum "
            "of the others");
  EXPECT_EQ(fault([](B& b) { b.attachments[0].inertia = Eigen::Vector3d(-1, 1, 1).asDiagonal(); }),
            "attachments[0]: inertia has the negative principal value -1 kg m^2");
  EXPECT_EQ(fault([](B& b) { b.attachments[0].name = "tip"; }),
            "attachments[0]: name \"tip\" is taken; choose another");
  EXPECT_EQ(fault([](B& b) { b.attachments.push_back(b.attachments[0]); }),
            "attachments[1]: name \"sensor\" is taken; choose another");
}

std::string mesh_fault(const std::function<void(Mesh&)>& spoil) {
  BeamGeometry boom = two_segments();
  boom.attachments = {sensor(0.2)};
  Mesh mesh = make_mesh(boom);
  spoil(mesh);
  return input_error([&] { assemble(mesh); });
}

TEST(Mesh, BadInputSaysWhatIsWrong) {
  EXPECT_EQ(input_error([] { Mesh{}.validate(); }), "mesh: has no elements");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.nodes(2, 3) = NAN; }), "mesh: node 3 has a coordinate that is not finite");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.elements[2].nodes[1] = 99; }),
            "mesh: beam-timoshenko element 2: node 99 is missing; the mesh has nodes 0 to 8");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.elements[2].nodes.push_back(0); }),
            "mesh: beam-timoshenko element 2: has 3 nodes; \"beam-timoshenko\" has 2");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.elements[2].type = 77; }),
            fmt::format("mesh: elements[2]: type 77 is not a row of the table of {} elements", element_types().size()));
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.elements[2].type = element_type("beam-euler-bernoulli"); }),
            "mesh: beam-euler-bernoulli element 2: type \"beam-euler-bernoulli\" does not agree with the theory of its "
            "property");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.elements[2].property = -1; }),
            "mesh: beam-timoshenko element 2: beam property -1 is missing; the mesh has 8");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.elements[2].order = 0; }),
            "mesh: beam-timoshenko element 2: order is 0; it must be 1 to 12");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.nodes.col(1) = m.nodes.col(0); }),
            "mesh: beam-timoshenko element 0: beam of zero length");
  EXPECT_EQ(mesh_fault([](Mesh& m) {
              m.beam_properties[0].y_axis = {2, 0, 0};
            }),
            "mesh: beam-timoshenko element 0: the y axis of the section is parallel to the beam");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.beam_properties[1].start = RoundBar{-1}; }),
            "mesh: beam_properties[1]: start: round bar: diameter [m]: is -1; it must be positive");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.elements.pop_back(); }), "mesh: node 8 belongs to no element");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.bodies[0].node = 42; }),
            "mesh: bodies[0]: node 42 is missing; the mesh has nodes 0 to 8");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.bodies[0].mass = -1; }),
            "mesh: bodies[0]: mass is -1 kg; it must be zero or positive");
  EXPECT_EQ(mesh_fault([](Mesh& m) { m.node_sets["clamp"] = {}; }), "mesh: node set \"clamp\": has no node");
  EXPECT_EQ(mesh_fault([](Mesh& m) {
              for (BeamProperty& p : m.beam_properties) p.rotary_inertia = false;
              m.nodes(1, 8) = 0.01;
            }),
            "mesh: beam-timoshenko element 7: a beam without rotary inertia must run along an axis of the mesh (its "
            "torsion has no mass)");
}

// Late ones are met at once by another thread than the first.
TEST(Mesh, TheFirstBadElementIsNamedByAnyNumberOfThreads) {
  Mesh mesh = make_mesh(uniform_boom(RoundBar{0.01}, 0.3, BeamTheory::timoshenko, 500, 1));
  for (const size_t e : {130U, 131U, 200U, 400U}) mesh.elements[e].order = 0;
  for (const int threads : {1, 2, 4}) {
    EXPECT_EQ(input_error([&] { mesh.validate(threads); }),
              "mesh: beam-timoshenko element 130: order is 0; it must be 1 to 12");
  }
}

TEST(Mesh, PartsAreCountedAndSuspicious) {
  Mesh mesh = make_mesh(two_segments());
  EXPECT_EQ(part_count(mesh), 1);
  EXPECT_TRUE(suspicions(mesh).empty());
  mesh.elements.erase(mesh.elements.begin() + 3);
  EXPECT_EQ(part_count(mesh), 2);
  ASSERT_EQ(suspicions(mesh).size(), 1U);
  EXPECT_EQ(suspicions(mesh)[0], "the mesh has 2 parts that nothing joins; each moves on its own");
  mesh.rigid_connections = {{3, {4}, all_components}};
  EXPECT_EQ(part_count(mesh), 1);
}

TEST(Mesh, CoincidentNodesAndMixedUpUnitsAreSuspicious) {
  Mesh mesh = make_mesh(two_segments());
  mesh.nodes.conservativeResize(3, mesh.nodes.cols() + 1);
  const auto twin = static_cast<int>(mesh.nodes.cols()) - 1;
  mesh.nodes.col(twin) = mesh.nodes.col(4);
  mesh.elements[4].nodes[0] = twin;
  ASSERT_EQ(suspicions(mesh).size(), 2U);
  EXPECT_TRUE(suspicions(mesh)[1].starts_with("1 pairs of nodes lie at one place")) << suspicions(mesh)[1];

  Mesh millimetres = make_mesh(two_segments());
  for (BeamProperty& p : millimetres.beam_properties) p.material.rho = 2.84e-9;  // t/mm^3
  ASSERT_FALSE(suspicions(millimetres).empty());
  EXPECT_NE(suspicions(millimetres)[0].find("units mixed up"), std::string::npos);
}

TEST(Mesh, BeamsSideBySideAreSuspicious) {
  Mesh mesh = make_mesh(two_segments());
  mesh.elements.push_back(mesh.elements[2]);
  std::ranges::reverse(mesh.elements.back().nodes);
  mesh.validate();
  ASSERT_EQ(suspicions(mesh).size(), 1U);
  EXPECT_EQ(suspicions(mesh)[0],
            "1 pairs of beams have the same nodes and lie side by side; the first are beam-timoshenko element 2 and "
            "beam-timoshenko element 8");
}

TEST(Mesh, SolidsThatCountTwiceAreRefused) {
  for (const char* element : {"hex", "hex8", "hex20", "tet10"}) {
    Mesh mesh = make_solid_mesh(two_segments(), {.element = element});
    mesh.validate();
    const std::size_t count = mesh.elements.size();
    mesh.elements.push_back(mesh.elements[2]);
    mesh.elements.push_back(mesh.elements[4]);
    EXPECT_EQ(input_error([&] { mesh.validate(); }),
              fmt::format("mesh: {0} element 2 and {0} element {1} have the same nodes: that part of the body would "
                          "count twice (2 such pairs); delete one",
                          element, count));
  }
}

TEST(Mesh, UnknownNodeSetListsThoseThatExist) {
  const Mesh mesh = make_mesh(two_segments());
  EXPECT_EQ(input_error([&] { node_set(mesh, "rooot"); }),
            "node set \"rooot\" not found; the mesh has \"root\", \"tip\"");
}

}  // namespace
}  // namespace flexboom::testing
