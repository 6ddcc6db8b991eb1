# Headers of the libraries as those see them who use an installed Wellspace: <wellspace/core/meshers/mesher.h> for
# core/meshers/mesher.h.
#
# wellspace_public_headers(NAME HEADERS…) makes them in build/…/include for the target wellspace_NAME, installs them, and
# lets programs that have Wellspace as a subproject include them. HEADERS are paths from the root; a header that one of
# them includes has to be there too, here or in an earlier call. docs/adr/0033-headers-are-installed-under-wellspace.md
# says why they are made and not copied.
function(wellspace_public_headers name)
  set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY WELLSPACE_PUBLIC_HEADERS ${ARGN})
  get_property(public DIRECTORY ${PROJECT_SOURCE_DIR} PROPERTY WELLSPACE_PUBLIC_HEADERS)
  list(JOIN public "|" public)
  list(JOIN ARGN "|" headers)
  list(TRANSFORM ARGN PREPEND ${PROJECT_SOURCE_DIR}/ OUTPUT_VARIABLE inputs)
  list(TRANSFORM ARGN PREPEND ${PROJECT_BINARY_DIR}/include/wellspace/ OUTPUT_VARIABLE outputs)
  set(script ${PROJECT_SOURCE_DIR}/cmake/make_public_headers.cmake)
  add_custom_command(
    OUTPUT ${outputs}
    COMMAND ${CMAKE_COMMAND} -D ROOT=${PROJECT_SOURCE_DIR} -D INTO=${PROJECT_BINARY_DIR}/include/wellspace
            "-DHEADERS=${headers}" "-DPUBLIC=${public}" -P ${script}
    DEPENDS ${inputs} ${script}
    VERBATIM)
  add_custom_target(wellspace_${name}_headers ALL DEPENDS ${outputs})
  add_dependencies(wellspace_${name} wellspace_${name}_headers)
  target_include_directories(wellspace_${name} INTERFACE $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>)
  if(WELLSPACE_INSTALL)
    foreach(header IN LISTS ARGN)
      get_filename_component(folder ${header} DIRECTORY)
      install(FILES ${PROJECT_BINARY_DIR}/include/wellspace/${header}
              DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/wellspace/${folder} COMPONENT development)
    endforeach()
  endif()
endfunction()
