#include "reduction/body/reduced_body.hpp"

#include "fem/base/check.hpp"
#include "reduction/invariants/eq14.hpp"
#include "tests/reduction/messages.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace flexboom {
namespace {

using test::message;

ReducedBody sample() { return eq14::reduced_body({1.2, 0.3, 5.0}, 2, eq14::Planes::xy_and_xz, "boom"); }

TEST(ReducedBody, RigidBodyIsABodyWithoutModes) {
  const Eigen::Matrix3d J = Eigen::Vector3d(2, 3, 4).asDiagonal();
  const ReducedBody body = rigid_body("hub", 8.5, Eigen::Vector3d::Zero(), J);
  EXPECT_EQ(body.n(), 0);
  EXPECT_EQ(body.structure, "rigid");
  EXPECT_EQ(body.Ct.cols(), 0);
  EXPECT_EQ(body.J0, J);
}

TEST(ReducedBody, ImpossibleRigidPartsAreRefused) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const Eigen::Matrix3d thin = Eigen::Vector3d(1, 1, 3).asDiagonal();
  const Eigen::Matrix3d negative = Eigen::Vector3d(1, 1, -1).asDiagonal();
  Eigen::Matrix3d skew = Eigen::Vector3d(1, 1, 1).asDiagonal();
  skew(0, 1) = 1e-3;
  const Eigen::Matrix3d good = Eigen::Matrix3d::Identity();
  EXPECT_NE(message([&] { rigid_body("b", 0, zero, good); }).find("m must be positive"), std::string::npos);
  EXPECT_NE(message([&] { rigid_body("b", 1, zero, thin); }).find("triangle"), std::string::npos);
  EXPECT_NE(message([&] { rigid_body("b", 1, zero, negative); }).find("not an inertia"), std::string::npos);
  EXPECT_NE(message([&] { rigid_body("b", 1, zero, skew); }).find("symmetric"), std::string::npos);
  // J0 about the origin smaller than what the offset of the mass centre alone gives.
  EXPECT_NE(message([&] { rigid_body("b", 1, Eigen::Vector3d(2, 0, 0), good); }).find("not an inertia"),
            std::string::npos);
}

TEST(ReducedBody, EveryWrongSizeNamesItsField) {
  const std::vector<std::pair<std::string, std::function<void(ReducedBody&)>>> faults = {
      {"Ct", [](ReducedBody& b) { b.Ct.conservativeResize(3, 1); }},
      {"Cr0", [](ReducedBody& b) { b.Cr0(0, 0) = std::nan(""); }},
      {"Cr1", [](ReducedBody& b) { b.Cr1.pop_back(); }},
      {"J1", [](ReducedBody& b) { b.J1.pop_back(); }},
      {"J2[1]", [](ReducedBody& b) { b.J2[1].pop_back(); }},
      {"Ke", [](ReducedBody& b) { b.Ke(0, 1) = 1; }},
      {"De", [](ReducedBody& b) { b.De.resize(0, 0); }},
      {"Me", [](ReducedBody& b) { b.Me(0, 0) = -1; }},
      {"coordinates", [](ReducedBody& b) { b.coordinates.clear(); }},
      {"marker \"tip\" S", [](ReducedBody& b) { b.markers[0].S.resize(3, 0); }},
      {"display.S", [](ReducedBody& b) { b.display.S.pop_back(); }},
      {"markers has \"tip\" twice", [](ReducedBody& b) { b.markers.push_back(b.markers[0]); }},
      {"interfaces has \"root\" twice",
       [](ReducedBody& b) {
         b.interfaces = {{.name = "root"}, {.name = "root"}};
       }},
      {"interface \"tip\"", [](ReducedBody& b) { b.interfaces = {{.name = "tip", .first_coordinate = 0}}; }},
      {"interface \"tip\"", [](ReducedBody& b) { b.interfaces = {{.name = "tip", .first_coordinate = -2}}; }},
      {"Kg.spin", [](ReducedBody& b) { b.Kg.spin = {b.Ke}; }},
      {"Kg.acceleration", [](ReducedBody& b) { b.Kg.acceleration.assign(3, Eigen::MatrixXd::Zero(2, 2)); }},
      {"Kg.angular_acceleration", [](ReducedBody& b) { b.Kg.angular_acceleration.assign(2, b.Ke); }},
      {"Kg of marker \"tipp\"",
       [](ReducedBody& b) {
         b.Kg.markers = {{"tipp", {}, {}}};
       }},
      {"Kg of marker \"tip\" torque",
       [](ReducedBody& b) {
         b.Kg.markers = {{"tip", {}, {b.Ke}}};
       }},
  };
  EXPECT_NO_THROW(sample().validate());
  for (const auto& [field, damage] : faults) {
    ReducedBody body = sample();
    damage(body);
    EXPECT_NE(message([&] { body.validate(); }).find(field), std::string::npos) << field;
  }
}

TEST(ReducedBody, MissingMarkerListsThoseThatExist) {
  const ReducedBody body = sample();
  EXPECT_EQ(marker(body, "tip").name, "tip");
  const std::string text = message([&] { marker(body, "tipp"); });
  EXPECT_NE(text.find("\"tipp\""), std::string::npos);
  EXPECT_NE(text.find("it has \"tip\""), std::string::npos);
}

TEST(Damping, ModalRatioIsTwoZetaOmegaMe) {
  ReducedBody body = sample();
  apply_damping(body, {"modal", 0.05});
  for (int k = 0; k < body.n(); ++k) {
    const double omega = 2 * 3.14159265358979323846 * body.coordinates[static_cast<size_t>(k)].frequency_hz;
    EXPECT_NEAR(body.De(k, k) / (2 * 0.05 * omega * body.Me(k, k)), 1, 1e-14);
  }
  EXPECT_EQ(body.De(0, 1), 0);
}

TEST(Damping, ModalRatioIsThatOfTheModesWhateverTheCoordinates) {
  ReducedBody modes = sample();
  apply_damping(modes, {"modal", 0.05});
  ReducedBody mixed = modes;  // q = T y, as the static shapes of Craig-Bampton are sums of modes
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(4, 4);
  T << 1, 0.4, 0, -0.2, 0.3, 1, 0.1, 0, -0.5, 0, 2, 0.7, 0, 0.6, -0.1, 1;
  mixed.Me = T.transpose() * modes.Me * T;
  mixed.Ke = T.transpose() * modes.Ke * T;
  apply_damping(mixed, {"modal", 0.05});
  const Eigen::MatrixXd expected = T.transpose() * modes.De * T;
  EXPECT_LT((mixed.De - expected).norm(), 1e-13 * expected.norm());
}

TEST(Damping, LossFactorIsTwiceTheRatio) {
  ReducedBody a = sample();
  ReducedBody b = sample();
  apply_damping(a, {"modal", 0.05});
  apply_damping(b, {"loss-factor", 0.1});
  EXPECT_EQ(a.De, b.De);
}

TEST(Damping, RayleighIsProportional) {
  ReducedBody body = sample();
  apply_damping(body, {"rayleigh", 0, 0.3, 2e-5});
  EXPECT_LT((body.De - 0.3 * body.Me - 2e-5 * body.Ke).norm(), 1e-16 * body.De.norm());
  apply_damping(body, {});
  EXPECT_EQ(body.De, Eigen::MatrixXd::Zero(4, 4));
}

TEST(Damping, BadRulesAreRefused) {
  ReducedBody body = sample();
  EXPECT_NE(message([&] { apply_damping(body, {"modell", 0.1}); }).find("\"modal\""), std::string::npos);
  EXPECT_THROW(apply_damping(body, {"modal", -0.1}), InputError);
  EXPECT_THROW(apply_damping(body, {"rayleigh", 0, 0, -1}), InputError);
}

}  // namespace
}  // namespace flexboom
