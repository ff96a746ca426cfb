# The target mujoco::mujoco: the release folder TRACEUR_MUJOCO_ROOT, or the system's. Installed beside
# the package file, so that a client links the engine Traceur was built with.
unset(TRACEUR_MUJOCO_INCLUDE CACHE)  # found anew: the root may have changed since the last time
if(TRACEUR_MUJOCO_ROOT)
  # A release archive or the Python wheel's `mujoco` folder: headers and one shared library.
  find_path(TRACEUR_MUJOCO_INCLUDE mujoco/mujoco.h PATHS ${TRACEUR_MUJOCO_ROOT}/include
            NO_DEFAULT_PATH REQUIRED)
  file(GLOB TRACEUR_MUJOCO_LIBRARY ${TRACEUR_MUJOCO_ROOT}/lib/libmujoco.so*
       ${TRACEUR_MUJOCO_ROOT}/libmujoco.so*)
  if(NOT TRACEUR_MUJOCO_LIBRARY)
    message(FATAL_ERROR "TRACEUR_MUJOCO_ROOT=${TRACEUR_MUJOCO_ROOT} holds no libmujoco.so")
  endif()
  list(GET TRACEUR_MUJOCO_LIBRARY 0 TRACEUR_MUJOCO_LIBRARY)
  add_library(mujoco::mujoco SHARED IMPORTED)
  set_target_properties(mujoco::mujoco PROPERTIES
    IMPORTED_LOCATION ${TRACEUR_MUJOCO_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${TRACEUR_MUJOCO_INCLUDE})
else()
  find_package(mujoco REQUIRED)
  # Debian's target names the headers of libraries that MuJoCo itself was built with; they are
  # neither needed nor always there.
  find_path(TRACEUR_MUJOCO_INCLUDE mujoco/mujoco.h REQUIRED)
  set_target_properties(mujoco::mujoco PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES ${TRACEUR_MUJOCO_INCLUDE} INTERFACE_LINK_LIBRARIES "")
endif()
