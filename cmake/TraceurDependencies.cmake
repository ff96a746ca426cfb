# Everything Traceur is built on: Debian's packages and the physics engine (tools/setup installs them).
find_package(Eigen3 REQUIRED)
find_package(fmt REQUIRED)
find_package(Threads REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(muparser REQUIRED)
find_package(tinyxml2 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(SQLite3 REQUIRED)
find_package(PNG REQUIRED)
find_package(CLI11 REQUIRED)
find_package(SVM REQUIRED)
find_package(NLopt REQUIRED)
find_package(box2d REQUIRED)

# The one home of the engine's version is what tools/setup fetches.
file(STRINGS ${PROJECT_SOURCE_DIR}/tools/mujoco.txt TRACEUR_MUJOCO_VERSION REGEX "^mujoco-core==")
string(REGEX MATCH "[0-9]+[.][0-9]+[.][0-9]+" TRACEUR_MUJOCO_VERSION "${TRACEUR_MUJOCO_VERSION}")
include(TraceurMujoco)

find_path(OSMESA_INCLUDE GL/osmesa.h REQUIRED)
find_library(OSMESA_LIBRARY OSMesa REQUIRED)
