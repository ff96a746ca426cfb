# The target mujoco::mujoco, from the folder TRACEUR_MUJOCO_ROOT: a release archive, the `mujoco` folder
# of a Python wheel, or what tools/setup has unpacked. Included by the installed package too, whose
# folder holds the engine Traceur was built with. The variable traceur_mujoco_root is that folder.
if(TRACEUR_MUJOCO_ROOT)
  set(traceur_mujoco_root ${TRACEUR_MUJOCO_ROOT})
else()
  set(traceur_mujoco_root ${PROJECT_SOURCE_DIR}/external/mujoco-${TRACEUR_MUJOCO_VERSION})
endif()
set(header ${traceur_mujoco_root}/include/mujoco/mujoco.h)
if(NOT EXISTS ${header})
  message(FATAL_ERROR "No MuJoCo in ${traceur_mujoco_root}: expected include/mujoco/mujoco.h. Run tools/setup.")
endif()
# 4000001 is 4.0.1.
file(STRINGS ${header} found REGEX "#define mjVERSION_HEADER")
string(REGEX REPLACE "[^0-9]" "" found "${found}")
string(REPLACE "." ";" parts ${TRACEUR_MUJOCO_VERSION})
list(GET parts 0 major)
list(GET parts 1 minor)
list(GET parts 2 patch)
math(EXPR expected "${major} * 1000000 + ${minor} * 1000 + ${patch}")
if(NOT found EQUAL expected)
  message(FATAL_ERROR "${traceur_mujoco_root} holds the MuJoCo whose mjVERSION_HEADER is ${found}: "
          "expected ${expected}, version ${TRACEUR_MUJOCO_VERSION}.")
endif()
set(traceur_mujoco_library libmujoco.so.${TRACEUR_MUJOCO_VERSION})
find_file(TRACEUR_MUJOCO_LIBRARY ${traceur_mujoco_library}
          PATHS ${traceur_mujoco_root} ${traceur_mujoco_root}/lib NO_CACHE NO_DEFAULT_PATH REQUIRED)
add_library(mujoco::mujoco SHARED IMPORTED)
set_target_properties(mujoco::mujoco PROPERTIES
  IMPORTED_LOCATION ${TRACEUR_MUJOCO_LIBRARY}
  INTERFACE_INCLUDE_DIRECTORIES ${traceur_mujoco_root}/include)
