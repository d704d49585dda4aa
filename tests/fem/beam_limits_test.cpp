// Estimates of what beams leave out, against the solids that they were measured on.

#include "fem/booms/beam_limits.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace flexboom {
namespace {

BeamGeometry boom(const SectionShape& shape, double length, double nu = 0.3) {
  BeamGeometry g;
  g.segments.push_back({shape, shape, length, {7e10, nu, 2700}});
  return g;
}

struct Measured {
  SectionShape shape;
  double length, nu;
  double bending_y, bending_z, torsion;  // the solid's lowest frequencies are higher [%]
};

// Frequencies of structure = "solid" to 1e-4 or better, over those of beams.
const std::vector<Measured> solids = {
    {Rectangle{0.1, 0.1}, 0.3, 0.3, 1.28, 1.28, 0.57},
    {Rectangle{0.1, 0.1}, 1.2, 0.3, 0.37, 0.37, 0.16},
    {Rectangle{0.025, 0.1}, 0.15, 0.3, 2.44, 1.03, 15.24},
    {Rectangle{0.025, 0.1}, 0.6, 0.3, 0.82, 0.32, 3.54},
    {Rectangle{0.025, 0.1}, 1.2, 0.3, 0.43, 0.16, 1.72},
    {Rectangle{0.006, 0.1}, 0.15, 0.3, 2.86, 0.72, 20.52},
    {Rectangle{0.006, 0.1}, 0.3, 0.3, 1.85, 0.39, 9.41},
    {Rectangle{0.006, 0.1}, 1.2, 0.3, 0.55, 0.11, 2.11},
    {Rectangle{0.1, 0.006}, 0.3, 0.3, 0.39, 1.85, 9.41},
    {Rectangle{0.025, 0.1}, 0.3, 0.45, 3.50, 1.41, 8.30},
    {Rectangle{0.025, 0.1}, 1.2, 0.45, 0.97, 0.40, 1.91},
    {Rectangle{0.025, 0.1}, 0.6, 0.0, 0.0, 0.0, 2.92},
    {RoundBar{0.1}, 0.2, 0.3, 1.48, 1.48, 0},
    {RoundBar{0.1}, 1.6, 0.3, 0.26, 0.26, 0},
    {Tube{0.1, 0.01}, 0.6, 0.3, 0.31, 0.31, 0},
    {Tube{0.1, 0.01}, 2.4, 0.3, 0.12, 0.12, 0},
};

TEST(BeamLimits, AreNearWhatSolidsShow) {
  constexpr double nearly = 1.6, nothing = 1e-12;
  const auto expect_near = [&](double estimate, double measured, const char* what) {
    EXPECT_GE(100 * estimate, measured / nearly) << what;
    EXPECT_LE(100 * estimate, measured * nearly + nothing) << what;
  };
  for (size_t i = 0; i < solids.size(); ++i) {
    SCOPED_TRACE(i);
    const Measured& m = solids[i];
    const BeamLimits found = beam_limits(boom(m.shape, m.length, m.nu));
    expect_near(found.bending_y, m.bending_y, "bending_y");
    expect_near(found.bending_z, m.bending_z, "bending_z");
    expect_near(found.torsion, m.torsion, "torsion");
  }
}

// The lowest mode of the solid that is none of a beam: tubes become oval, the width of a strip bends.
TEST(BeamLimits, SectionsVibrateWhereSolidsDo) {
  const auto frequency = [](const SectionShape& shape) { return beam_limits(boom(shape, 1.2)).section_frequency; };
  EXPECT_NEAR(frequency(Tube{0.1, 0.002}), 551, 0.02 * 551);  // longer tubes are nearer
  EXPECT_NEAR(frequency(Tube{0.1, 0.01}), 3210, 0.05 * 3210);
  EXPECT_NEAR(frequency(Rectangle{0.006, 0.1}), 3430, 0.05 * 3430);
  EXPECT_EQ(frequency(Rectangle{0.006, 0.1}), frequency(Rectangle{0.1, 0.006}));
  EXPECT_LT(frequency(RectangularTube{0.05, 0.1, 0.0015}), 384);  // L / width = 6; a long one comes lower
  EXPECT_GT(frequency(RectangularTube{0.05, 0.1, 0.0015}), 384 / 2.0);
  EXPECT_TRUE(std::isinf(frequency(RoundBar{0.1})));
  EXPECT_TRUE(std::isinf(frequency(GeneralSection{1e-4, 1e-9, 1e-9, 1e-9})));
}

// E / (2 G) - 1 of a laminate is no Poisson's ratio.
TEST(BeamLimits, OfFibresHaveNoPoissonsRatio) {
  for (const double nu : {-0.9, 0.7, 5.0}) {
    const BeamLimits found = beam_limits(boom(Rectangle{0.02, 0.8}, 1.2, nu)),
                     none = beam_limits(boom(Rectangle{0.02, 0.8}, 1.2, 0));
    EXPECT_EQ(found.bending_y, 0) << nu;
    EXPECT_EQ(found.section_frequency, none.section_frequency) << nu;
    EXPECT_EQ(found.torsion > none.torsion, nu > 0) << nu;  // E / G is what resists warping
  }
}

TEST(BeamLimits, AreSaidWhereTheyCount) {
  EXPECT_EQ(beam_doubt(boom(RoundBar{0.005}, 0.295)), "");
  EXPECT_EQ(beam_doubt(boom(GeneralSection{1e-4, 1e-9, 1e-9, 1e-9}, 0.1)), "");
  const BeamGeometry panel = boom(Rectangle{0.02, 0.8}, 1.2);
  EXPECT_NE(beam_doubt(panel).find("3 % in bending along y, 21 % in torsion"), std::string::npos) << beam_doubt(panel);
  EXPECT_NE(beam_doubt(panel, true).find("about 3 % in bending along y; structure"), std::string::npos);
  EXPECT_EQ(section_doubt(panel, 0.5 * beam_limits(panel).section_frequency), "");
  EXPECT_NE(section_doubt(panel, 2 * beam_limits(panel).section_frequency), "");
  BeamGeometry stepped = boom(RoundBar{0.1}, 1.0);
  stepped.segments.push_back({Tube{0.1, 0.01}, Tube{0.1, 0.002}, 1.0, {7e10, 0.3, 2700}});  // the thinnest counts
  EXPECT_EQ(beam_limits(stepped).section_frequency, beam_limits(boom(Tube{0.1, 0.002}, 1)).section_frequency);
}

}  // namespace
}  // namespace flexboom
