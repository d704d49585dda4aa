#pragma once

#include "apps/scene/scene.hpp"

namespace flexboom {

/// Gives bodies of basis "prestressed" that name no motion a steady one, all bodies taken as rigid. Free bodies spin as
/// at the start. Other joints rest at zero or where their spring does. The steady motion has their spin, and the
/// acceleration that keeps all of them turning about their mass centre with it. Their roots turn as the joint that
/// carries them lets them. A spring, a stop, a law, a drive or a motion holds them. @throws InputError as Tree.
Scene with_steady_motions(Scene);

}  // namespace flexboom
