# cmake -DBUILD=… -DSOURCE=… -DWORK=… -P: installs, builds a client against the installation, runs
# it, and checks that a wrong version is refused.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${ARGN}\n${out}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
set(configure ${CMAKE_COMMAND} -S ${SOURCE} -G Ninja -DCMAKE_PREFIX_PATH=${WORK}/prefix)
run(${configure} -B ${WORK}/client -DWANTED=0.1)
run(${CMAKE_COMMAND} --build ${WORK}/client)
# From where no models/ is above, so that only the installation's own can be found.
run(${CMAKE_COMMAND} -E env --unset=TRACEUR_DATA ${CMAKE_COMMAND} -E chdir / ${WORK}/client/client)
run(${CMAKE_COMMAND} -E env --unset=TRACEUR_DATA ${CMAKE_COMMAND} -E chdir /
    ${WORK}/prefix/bin/traceur inspect bioloid-gp)
execute_process(COMMAND ${configure} -B ${WORK}/wrong -DWANTED=99.0
                RESULT_VARIABLE code OUTPUT_QUIET ERROR_QUIET)
if(code EQUAL 0)
  message(FATAL_ERROR "version 99.0 was accepted")
endif()
