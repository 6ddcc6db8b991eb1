# The parts that are built: builds_core, builds_client, ... and builds_all, after WELLSPACE_COMPONENTS.

set(known_components core formats client server tool python)
set(WELLSPACE_COMPONENTS ${known_components}
    CACHE STRING "What is built: core, formats, client, server, tool, python; each with those that it needs")

set(wanted ${WELLSPACE_COMPONENTS})
foreach(component IN LISTS wanted)
  if(NOT component IN_LIST known_components)
    message(FATAL_ERROR "WELLSPACE_COMPONENTS has '${component}'; there are: ${known_components}")
  endif()
endforeach()
if("tool" IN_LIST wanted)
  list(APPEND wanted core formats client server)
endif()
if("server" IN_LIST wanted)
  list(APPEND wanted core)
endif()

set(builds_all ON)
foreach(component IN LISTS known_components)
  if(component IN_LIST wanted)
    set(builds_${component} ON)
  else()
    set(builds_${component} OFF)
    set(builds_all OFF)
  endif()
endforeach()
