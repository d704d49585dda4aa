# ARPACK-NG as the target ARPACK::ARPACK. Used by the build and, installed beside flexboomConfig.cmake, by consumers.
find_path(ARPACK_INCLUDE_DIR arpack/arpack.hpp)
find_library(ARPACK_LIBRARY arpack)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(ARPACK REQUIRED_VARS ARPACK_LIBRARY ARPACK_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "On Debian: apt-get install libarpack2-dev")
mark_as_advanced(ARPACK_INCLUDE_DIR ARPACK_LIBRARY)

if(ARPACK_FOUND AND NOT TARGET ARPACK::ARPACK)
  add_library(ARPACK::ARPACK UNKNOWN IMPORTED)
  set_target_properties(ARPACK::ARPACK PROPERTIES
    IMPORTED_LOCATION ${ARPACK_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${ARPACK_INCLUDE_DIR})
endif()
