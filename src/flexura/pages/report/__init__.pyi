from flexura.pages.report.report import Report as Report
from flexura.pages.report.report import report as report
