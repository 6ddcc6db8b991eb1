# Copies HEADERS, paths from ROOT joined by `|`, to INTO, and writes the project's includes in them as programs that use
# Wellspace do: "core/mesh/mesh.h" becomes "wellspace/core/mesh/mesh.h". Fails if one of these is not among PUBLIC, so that no
# installed header includes one that is not.
cmake_policy(VERSION 3.25)
string(REPLACE "|" ";" HEADERS "${HEADERS}")
string(REPLACE "|" ";" PUBLIC "${PUBLIC}")
foreach(header IN LISTS HEADERS)
  file(READ ${ROOT}/${header} text)
  string(REGEX MATCHALL "#include \"[^\"\n]+\"" includes "${text}")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "#include \"(.*)\"" "\\1" included "${include}")
    if(included IN_LIST PUBLIC)
      string(REPLACE "${include}" "#include \"wellspace/${included}\"" text "${text}")
    elseif(EXISTS ${ROOT}/${included})
      message(FATAL_ERROR "${header} is public and includes ${included}, which is not: add it to "
                          "wellspace_public_headers() of its library, or do without it")
    endif()
  endforeach()
  file(WRITE ${INTO}/${header} "${text}")
endforeach()
