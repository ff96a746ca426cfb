# One folder = one target = one namespace: traceur_module(NAME sim HEADERS … SOURCES … TESTS …
# PUBLIC … PRIVATE …). Headers live beside their sources and are installed through a file set;
# every header is also compiled alone (target all_verify_interface_header_sets).

# GNU's contraction of a*b+c would make results depend on the compiler's choices.
add_library(traceur_flags INTERFACE)
target_compile_options(traceur_flags INTERFACE
  $<BUILD_INTERFACE:-Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -ffp-contract=off>
  $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:Clang>:-Wno-missing-field-initializers>>  # it has no eye for members' defaults
  $<BUILD_INTERFACE:$<$<BOOL:${TRACEUR_WERROR}>:-Werror>>)
if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  # Files of one compilation see each other's anonymous names, which is no fault of theirs.
  target_compile_options(traceur_flags INTERFACE $<BUILD_INTERFACE:-Wno-shadow -Wno-subobject-linkage>)
endif()
if(TRACEUR_SANITIZE)
  target_compile_options(traceur_flags INTERFACE
    $<BUILD_INTERFACE:-fsanitize=${TRACEUR_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all>
    $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:Clang>:-fsanitize-ignorelist=${CMAKE_CURRENT_LIST_DIR}/sanitize_ignore.txt>>)
  if(TRACEUR_SANITIZE MATCHES fuzzer)
    target_compile_options(traceur_flags INTERFACE
      $<BUILD_INTERFACE:-fsanitize-coverage-ignorelist=${CMAKE_CURRENT_LIST_DIR}/sanitize_ignore.txt>)
  endif()
  target_link_options(traceur_flags INTERFACE $<BUILD_INTERFACE:-fsanitize=${TRACEUR_SANITIZE}>)
endif()
if(NOT CMAKE_CXX_FLAGS_DEV)  # CMake itself caches an empty one for build types it does not know
  set(CMAKE_CXX_FLAGS_DEV "-O2 -g1" CACHE STRING "Optimised, with assertions" FORCE)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG" CACHE STRING "Optimised" FORCE)
set(CMAKE_VERIFY_INTERFACE_HEADER_SETS ON)

function(traceur_module)
  cmake_parse_arguments(M "" "NAME" "HEADERS;SOURCES;TESTS;PUBLIC;PRIVATE" ${ARGN})
  set(target traceur_${M_NAME})
  add_library(${target} STATIC ${M_SOURCES})
  add_library(traceur::${M_NAME} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${M_NAME})
  target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}
                 FILES ${M_HEADERS})
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_link_libraries(${target} PUBLIC ${M_PUBLIC}
    PRIVATE $<BUILD_INTERFACE:traceur_flags> ${M_PRIVATE})
  install(TARGETS ${target} EXPORT traceurTargets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  if(TRACEUR_BUILD_TESTS AND M_TESTS)
    traceur_test(NAME ${M_NAME}_test SOURCES ${M_TESTS} LIBRARIES ${target} ${M_PRIVATE})
  endif()
endfunction()

# A GoogleTest program; its cases appear one by one in ctest. Tests run from the repository's root,
# so that `models/…` and `skills/…` mean the same to them as to a reader.
function(traceur_test)
  cmake_parse_arguments(T "" "NAME" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${T_NAME} ${T_SOURCES})
  target_link_libraries(${T_NAME} PRIVATE traceur_flags ${T_LIBRARIES} GTest::gtest
                        GTest::gtest_main)
  gtest_discover_tests(${T_NAME} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} DISCOVERY_TIMEOUT 60
                       PROPERTIES TIMEOUT 240)
endfunction()
