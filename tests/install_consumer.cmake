# cmake -DBUILD_DIR=... -DWORK_DIR=... -DSOURCE_DIR=... -DVERSION=... -P install_consumer.cmake
set(prefix ${WORK_DIR}/prefix)
set(consumer ${WORK_DIR}/consumer)
file(REMOVE_RECURSE ${prefix} ${consumer})

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "failed (${result}): ${ARGN}\n${out}")
  endif()
  set(out "${out}" PARENT_SCOPE)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})
run(${CMAKE_COMMAND} -S ${SOURCE_DIR} -B ${consumer} -G ${GENERATOR} -DCMAKE_PREFIX_PATH=${prefix}
  -DCMAKE_BUILD_TYPE=${BUILD_TYPE} -DCMAKE_CXX_COMPILER=${CXX_COMPILER}
  -DCMAKE_CXX_COMPILER_LAUNCHER=${CXX_LAUNCHER} -Dexpected_version=${VERSION})
run(${CMAKE_COMMAND} --build ${consumer})
run(${consumer}/consumer)
message("${out}")
# Headers for tests stay at home.
file(GLOB_RECURSE for_tests ${prefix}/include/*_fixture.h ${prefix}/include/*_twin.h ${prefix}/include/test_*.h
     ${prefix}/include/temp_folder.h)
if(for_tests)
  message(FATAL_ERROR "headers of tests were installed: ${for_tests}")
endif()
