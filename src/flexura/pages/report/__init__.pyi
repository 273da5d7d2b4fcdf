from flexura.pages.report.document import Content as Content
from flexura.pages.report.document import Paragraph as Paragraph
from flexura.pages.report.gallery import REPORTS as REPORTS
from flexura.pages.report.gallery import save_designs as save_designs
from flexura.pages.report.report import Report as Report
from flexura.pages.report.report import report as report
