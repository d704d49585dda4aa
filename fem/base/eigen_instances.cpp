// Here the list of the header defines what it declares elsewhere; this file has no precompiled header before it.
#define FLEXBOOM_EIGEN_INSTANCE template
#include "fem/base/eigen_instances.hpp"
