// The page without a mesh, as read-only data of the program: what page.h calls EmptyPage. The build says where it is.

asm(R"(
.section .rodata
.global wellspace_viewer_page_begin
.global wellspace_viewer_page_end
wellspace_viewer_page_begin:
.incbin ")" WELLSPACE_VIEWER_PAGE R"("
wellspace_viewer_page_end:
.byte 0
.previous
)");
