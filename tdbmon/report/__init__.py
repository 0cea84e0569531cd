"""Reports: one document of sections, paragraphs, tables and figures, written as HTML or PDF."""

from tdbmon.report.document import Document
from tdbmon.report.drop_report import build_report
from tdbmon.report.html import write_html
from tdbmon.report.pdf import write_pdf

__all__ = ["Document", "build_report", "write_html", "write_pdf"]
