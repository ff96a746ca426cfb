# `cmake --install` and find_package(traceur): libraries, headers, the program, models and skills.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/traceur)
install(EXPORT traceurTargets NAMESPACE traceur:: DESTINATION ${package_dir})
set(data_dir ${CMAKE_INSTALL_DATADIR}/traceur)
configure_package_config_file(cmake/traceurConfig.cmake.in
  ${PROJECT_BINARY_DIR}/traceurConfig.cmake INSTALL_DESTINATION ${package_dir} PATH_VARS data_dir mujoco_dir)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/traceurConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/traceurConfig.cmake
  ${PROJECT_BINARY_DIR}/traceurConfigVersion.cmake cmake/FindSVM.cmake cmake/TraceurMujoco.cmake
  DESTINATION ${package_dir})
install(DIRECTORY models skills DESTINATION ${CMAKE_INSTALL_DATADIR}/traceur)
file(GLOB licences ${traceur_mujoco_root}/LICENSE*)
install(FILES ${TRACEUR_MUJOCO_LIBRARY} ${licences} DESTINATION ${mujoco_dir})
install(DIRECTORY ${traceur_mujoco_root}/include DESTINATION ${mujoco_dir})
